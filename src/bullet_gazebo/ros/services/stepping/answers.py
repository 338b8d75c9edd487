"""What step_world answers: joints in any case, and what else was asked for."""

import struct
from collections.abc import Sequence
from io import BytesIO
from typing import Any

from bullet_gazebo_msgs.srv import StepWorldResponse
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.ros.wire.conversions import (
    to_contact_state,
    to_pose_msg,
    to_time,
    to_twist_msg,
)
from bullet_gazebo.state.query import StateAnswer

# As StepWorld.srv has them: success, length of no text, sim_time; the joints' header: seq, stamp, no frame.
HEAD = struct.Struct("<BId3II")
LENGTH = struct.Struct("<I")
NOTHING_MORE = bytes(6 * LENGTH.size)  # models, links and contacts: six empty lists


class ToldJoints:
    """The joints of all robots, and what answers call them."""

    def __init__(self, robots: Sequence[ControlledRobot]) -> None:
        each = [(robot, joint) for robot in robots for joint in robot.hardware.joints.values()]
        scoped = len(robots) > 1
        self.joints: list[JointHandle] = [joint for _, joint in each]
        self.names = [f"{r.model.name}::{j.name}" if scoped else j.name for r, j in each]
        whole = [LENGTH.pack(len(self.names))]
        for name in self.names:
            text = name.encode()
            whole += [LENGTH.pack(len(text)), text]
        self.names_on_the_wire = b"".join(whole)
        self.numbers = struct.Struct(
            f"<I{len(self.names)}d"
        )  # of each joint one, their count in front

    def message(self, now: int) -> JointState:
        """Their state; `now` [ns]."""
        joints = self.joints
        return JointState(
            header=Header(stamp=to_time(now)),
            name=self.names,
            position=[joint.position for joint in joints],
            velocity=[joint.velocity for joint in joints],
            effort=[joint.effort for joint in joints],
        )


class JointsAnswer(StepWorldResponse):
    """The answer to who asks for joints only. Their names are put together once, not for each answer."""

    def __init__(self, told: ToldJoints, sim_time: float, now: int) -> None:
        super().__init__(success=True, sim_time=sim_time, joint_states=told.message(now))
        self._told = told

    def serialize(self, buff: BytesIO) -> None:
        states, told = self.joint_states, self._told
        count, stamp, numbers = len(told.names), states.header.stamp, told.numbers
        buff.write(HEAD.pack(True, 0, self.sim_time, states.header.seq, stamp.secs, stamp.nsecs, 0))
        buff.write(told.names_on_the_wire)
        for values in (states.position, states.velocity, states.effort):
            buff.write(numbers.pack(count, *values))
        buff.write(NOTHING_MORE)


def fields_of(answer: StateAnswer) -> dict[str, Sequence[Any]]:
    """What else was asked for, as fields of a response."""
    models = answer.models.values()
    return {
        "model_names": list(answer.models),
        "model_poses": [to_pose_msg(pose) for pose, _ in models],
        "model_twists": [to_twist_msg(twist) for _, twist in models],
        "link_poses": [to_pose_msg(pose) for pose, _ in answer.links],
        "link_twists": [to_twist_msg(twist) for _, twist in answer.links],
        "contacts": [to_contact_state(pair) for pair in answer.contacts],
    }
