"""State and properties of models and links (docs/contract/gazebo.md 2.7 to 2.9 and 2.11 to 2.15)."""

import contextlib
from collections import Counter
from dataclasses import replace

import rospy
from gazebo_msgs import srv
from gazebo_msgs.msg import LinkState, ModelState
from std_msgs.msg import Header

from bullet_gazebo.common.messages import (
    from_pose_msg,
    from_twist_msg,
    to_pose_msg,
    to_time,
    to_twist_msg,
    to_vector,
)
from bullet_gazebo.services import NO_LINK, NO_MODEL, SCOPE, ServiceRefused, check_message, existing, offer
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.engine import Twist, seen_from
from robot_sim.physics.model import AT_REST
from robot_sim.physics.pose import Pose, rotate, subtract
from robot_sim.physics.properties import PropertyError, link_inertia, set_link_properties
from robot_sim.physics.world import WORLD_FRAMES
from robot_sim.simulator import Simulator

TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
QUEUE = 10


class _StateResponse(srv.GetModelStateResponse):
    """Keeps our header.seq: rospy overwrites it in responses that say they begin with a header."""

    _has_header = False


class ModelServices:
    """get_model_properties, get_model_state and set_model_state, which is also a topic without answers."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._calls: Counter[str] = Counter()  # header.seq counts the calls for each name
        self._services = [
            rospy.Service("~get_model_state", srv.GetModelState, self._get_state),
            offer("~get_model_properties", srv.GetModelProperties, self._get_properties),
            offer("~set_model_state", srv.SetModelState, self._set_state),
        ]
        self._topic = rospy.Subscriber("~set_model_state", ModelState, self._hear, queue_size=QUEUE)

    def _get_properties(self, request: srv.GetModelPropertiesRequest) -> srv.GetModelPropertiesResponse:
        with self._sim.lock.glance():
            model = existing(self._sim.world.model(request.model_name), NO_MODEL)
            # All names are unscoped, and canonical_body_name is never filled.
            return srv.GetModelPropertiesResponse(
                body_names=model.link_names,
                geom_names=[name for link in model.link_names for name in model.collisions(link)],
                joint_names=model.all_joints,
                is_static=model.description.static,
                success=True,
                status_message="GetModelProperties: got properties",
            )

    def _get_state(self, request: srv.GetModelStateRequest) -> srv.GetModelStateResponse:
        response = _StateResponse()
        with self._sim.lock.glance():
            model = self._sim.world.model(request.model_name)
            if model is None:
                response.status_message = "GetModelState: model does not exist"
                return response
            self._calls[request.model_name] += 1
            # The wall's time with use_sim_time:=false, as in Gazebo. rospy's simulated time may lag behind
            # where /clock is thinned.
            wall = rospy.rostime.is_wallclock()
            stamp = rospy.get_rostime() if wall else to_time(self._sim.now)
            count = self._calls[request.model_name]
            response.header = Header(count, stamp, request.relative_entity_name)
            frame = self._sim.world.frame(request.relative_entity_name)
            if frame is None:
                response.status_message = (
                    "GetModelState: reference relative_entity_name not found, "
                    "did you forget to scope the body by model name?"
                )
                return response
            pose, twist = seen_from(model.state(), frame)
        response.pose, response.twist = to_pose_msg(pose), to_twist_msg(twist)
        response.success = True
        response.status_message = "GetModelState: got properties"
        return response

    def _hear(self, state: ModelState) -> None:
        with contextlib.suppress(ServiceRefused):
            self._set_state(srv.SetModelStateRequest(state))

    def _set_state(self, request: srv.SetModelStateRequest) -> str:
        wanted = request.model_state
        with self._sim.lock:
            model = existing(self._sim.world.model(wanted.model_name), NO_MODEL)
            frame = existing(
                self._sim.world.frame(wanted.reference_frame),
                "specified reference frame entity does not exist",
            )
            check_message(wanted)
            # The twist is turned with the frame; the frame's own velocity is not added.
            linear, angular = (rotate(frame[0].orientation, part) for part in from_twist_msg(wanted.twist))
            pose = frame[0].compose(from_pose_msg(wanted.pose))
            self._sim.place_model(model, pose, (linear, angular))
        return "SetModelState: set model state done"


class LinkServices:
    """get_ and set_link_properties, get_ and set_link_state, which is also a topic without answers."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            offer("~get_link_properties", srv.GetLinkProperties, self._get_properties),
            offer("~set_link_properties", srv.SetLinkProperties, self._set_properties),
            offer("~get_link_state", srv.GetLinkState, self._get_state),
            offer("~set_link_state", srv.SetLinkState, self._set_state),
        ]
        self._topic = rospy.Subscriber("~set_link_state", LinkState, self._hear, queue_size=QUEUE)

    def _get_properties(self, request: srv.GetLinkPropertiesRequest) -> srv.GetLinkPropertiesResponse:
        with self._sim.lock.glance():
            link = existing(self._sim.world.link(request.link_name), NO_LINK)
            inertia, gravity = link_inertia(*link), link[0].description.links[link[1]].gravity
        return srv.GetLinkPropertiesResponse(
            com=to_pose_msg(Pose(inertia.com.position)),  # never its orientation
            gravity_mode=gravity,
            mass=inertia.mass,
            success=True,
            status_message="GetLinkProperties: got properties",
            **{key: getattr(inertia, key) for key in TENSOR},
        )

    def _set_properties(self, request: srv.SetLinkPropertiesRequest) -> str:
        with self._sim.lock:
            link = existing(self._sim.world.link(request.link_name), NO_LINK)
            check_message(request)
            old = link_inertia(*link)
            inertia = replace(
                old,
                mass=request.mass,
                com=old.com._replace(position=to_vector(request.com.position)),
                **{key: getattr(request, key) for key in TENSOR},
            )
            try:
                set_link_properties(self._sim.world, *link, inertia, request.gravity_mode)
            except (PropertyError, DescriptionError) as error:
                raise ServiceRefused(str(error)) from error
        return "SetLinkProperties: properties set"

    def _get_state(self, request: srv.GetLinkStateRequest) -> srv.GetLinkStateResponse:
        with self._sim.lock.glance():
            world = self._sim.world
            link = existing(world.link(request.link_name), NO_LINK)
            fault = f"reference reference_frame not found, {SCOPE}"
            frame = existing(world.frame(request.reference_frame), fault)
            pose, twist = seen_from(link[0].link_state(link[1]), frame)
        state = LinkState(request.link_name, to_pose_msg(pose), to_twist_msg(twist), request.reference_frame)
        return srv.GetLinkStateResponse(state, True, "GetLinkState: got state")

    def _hear(self, state: LinkState) -> None:
        with contextlib.suppress(ServiceRefused):
            self._set_state(srv.SetLinkStateRequest(state))

    def _set_state(self, request: srv.SetLinkStateRequest) -> str:
        wanted = request.link_state
        with self._sim.lock:
            link = existing(self._sim.world.link(wanted.link_name), "link does not exist")
            frame = existing(self._frame(wanted.reference_frame), "failed")
            check_message(wanted)
            linear, angular = from_twist_msg(wanted.twist)
            # Gazebo subtracts the frame's velocity, and doesn't turn the request's.
            twist = (subtract(linear, frame[1][0]), subtract(angular, frame[1][1]))
            self._sim.place_link(*link, frame[0].compose(from_pose_msg(wanted.pose)), twist)
        return "SetLinkState: success"

    def _frame(self, name: str) -> tuple[Pose, Twist] | None:
        """Returns the state of a link or the world; a model is not a frame here."""
        link = self._sim.world.link(name)
        if link is not None:
            return link[0].link_state(link[1])
        return (Pose(), AT_REST) if name in WORLD_FRAMES else None
