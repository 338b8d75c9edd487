"""get_model_state, get_model_properties, get_world_properties (docs/contract/gazebo.md 2.7 to 2.9)."""

from collections import Counter

import genpy
import rospy
from gazebo_msgs.srv import (
    GetModelProperties,
    GetModelPropertiesRequest,
    GetModelPropertiesResponse,
    GetModelState,
    GetModelStateRequest,
    GetModelStateResponse,
    GetWorldProperties,
    GetWorldPropertiesRequest,
    GetWorldPropertiesResponse,
)
from std_msgs.msg import Header

from bullet_gazebo.physics.world import seen_from
from bullet_gazebo.ros.wire.conversions import to_pose_msg, to_time, to_twist_msg
from bullet_gazebo.simulator import Simulator


class _StateResponse(GetModelStateResponse):
    """rospy puts its own count into header.seq of responses that say they begin with a header."""

    _has_header = False


class ModelServices:
    """Services that tell where models are."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._calls: Counter[str] = Counter()  # header.seq counts the calls for each name
        self._services = [
            rospy.Service("~get_model_state", GetModelState, self._get_state),
            rospy.Service("~get_model_properties", GetModelProperties, self._get_properties),
            rospy.Service("~get_world_properties", GetWorldProperties, self._get_world),
        ]

    def _get_world(self, request: GetWorldPropertiesRequest) -> GetWorldPropertiesResponse:
        with self._sim.lock:
            return GetWorldPropertiesResponse(
                sim_time=self._sim.sim_time,
                model_names=list(self._sim.world.models),
                rendering_enabled=False,  # no cameras here: who waits for pictures has to know
                success=True,
                status_message="GetWorldProperties: got properties",
            )

    def _get_properties(self, request: GetModelPropertiesRequest) -> GetModelPropertiesResponse:
        with self._sim.lock:
            model = self._sim.world.model(request.model_name)
            if model is None:
                return GetModelPropertiesResponse(
                    status_message="GetModelProperties: model does not exist"
                )
            # All names are unscoped, and canonical_body_name is never filled.
            return GetModelPropertiesResponse(
                body_names=model.link_names,
                geom_names=[name for link in model.link_names for name in model.collisions(link)],
                joint_names=model.all_joints,
                is_static=model.description.static,
                success=True,
                status_message="GetModelProperties: got properties",
            )

    def _get_state(self, request: GetModelStateRequest) -> GetModelStateResponse:
        response = _StateResponse()
        with self._sim.lock:
            model = self._sim.world.model(request.model_name)
            if model is None:
                response.status_message = "GetModelState: model does not exist"
                return response
            self._calls[request.model_name] += 1
            response.header = Header(
                self._calls[request.model_name],
                self._stamp(),
                request.relative_entity_name,
            )
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

    def _stamp(self) -> genpy.Time:
        """The node's own time, as Gazebo stamps it: the wall's with use_sim_time:=false."""
        # rospy's simulated time may lag behind where /clock is thinned.
        return rospy.get_rostime() if rospy.rostime.is_wallclock() else to_time(self._sim.now)
