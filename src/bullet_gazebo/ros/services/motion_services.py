"""set_model_state and set_link_state, services and topics (docs/contract/gazebo.md 2.14 and 2.15)."""

import rospy
from gazebo_msgs.msg import LinkState, ModelState
from gazebo_msgs.srv import (
    SetLinkState,
    SetLinkStateRequest,
    SetLinkStateResponse,
    SetModelState,
    SetModelStateRequest,
    SetModelStateResponse,
)

from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.model import AT_REST
from bullet_gazebo.physics.pose import Pose, rotate, subtract
from bullet_gazebo.physics.world import WORLD_FRAMES
from bullet_gazebo.ros.wire.checks import bad_number
from bullet_gazebo.ros.wire.conversions import from_pose_msg, from_twist_msg
from bullet_gazebo.simulator import Simulator

QUEUE = 10


class MotionServices:
    """Puts models and links where a client wants them. The topics do the same and discard the answer."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~set_model_state", SetModelState, self._set_model),
            rospy.Service("~set_link_state", SetLinkState, self._set_link),
        ]
        self._topics = [
            rospy.Subscriber("~set_model_state", ModelState, self._hear_model, queue_size=QUEUE),
            rospy.Subscriber("~set_link_state", LinkState, self._hear_link, queue_size=QUEUE),
        ]

    def _hear_model(self, state: ModelState) -> None:
        self._set_model(SetModelStateRequest(state))

    def _hear_link(self, state: LinkState) -> None:
        self._set_link(SetLinkStateRequest(state))

    def _set_model(self, request: SetModelStateRequest) -> SetModelStateResponse:
        wanted = request.model_state
        with self._sim.lock:
            model = self._sim.world.model(wanted.model_name)
            if model is None:
                return _model_fault("model does not exist")
            frame = self._sim.world.frame(wanted.reference_frame)
            if frame is None:
                return _model_fault("specified reference frame entity does not exist")
            fault = bad_number(wanted)
            if fault:
                return _model_fault(fault)
            # The twist is turned with the frame; the frame's own velocity is not added.
            linear, angular = (
                rotate(frame[0].orientation, part) for part in from_twist_msg(wanted.twist)
            )
            pose = frame[0].compose(from_pose_msg(wanted.pose))
            self._sim.place_model(model, pose, (linear, angular))
        return SetModelStateResponse(True, "SetModelState: set model state done")

    def _set_link(self, request: SetLinkStateRequest) -> SetLinkStateResponse:
        wanted = request.link_state
        with self._sim.lock:
            found = self._sim.world.link(wanted.link_name)
            if found is None:
                return SetLinkStateResponse(False, "SetLinkState: link does not exist")
            frame = self._link_frame(wanted.reference_frame)
            if frame is None:
                return SetLinkStateResponse(False, "SetLinkState: failed")
            fault = bad_number(wanted)
            if fault:
                return SetLinkStateResponse(False, f"SetLinkState: {fault}")
            linear, angular = from_twist_msg(wanted.twist)
            # Gazebo takes the frame's velocity away, and doesn't turn the request's.
            twist = (subtract(linear, frame[1][0]), subtract(angular, frame[1][1]))
            self._sim.place_link(*found, frame[0].compose(from_pose_msg(wanted.pose)), twist)
        return SetLinkStateResponse(True, "SetLinkState: success")

    def _link_frame(self, name: str) -> tuple[Pose, Twist] | None:
        """A link or the world; a model is no frame here."""
        found = self._sim.world.link(name)
        if found is not None:
            return found[0].link_state(found[1])
        return (Pose(), AT_REST) if name in WORLD_FRAMES else None


def _model_fault(fault: str) -> SetModelStateResponse:
    return SetModelStateResponse(False, f"SetModelState: {fault}")
