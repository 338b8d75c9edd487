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
from bullet_gazebo.ros.common.messages import (
    to_contact_state,
    to_pose_msg,
    to_time,
    to_twist_msg,
)
from bullet_gazebo.simulator import NANOSECONDS
from bullet_gazebo.state import StateAnswer

# As StepWorld.srv has them: success, length of no text, sim_time; the joints' header: seq, stamp, no frame.
HEAD = struct.Struct("<BId3II")
LENGTH = struct.Struct("<I")
NOTHING_MORE = bytes(6 * LENGTH.size)  # models, links and contacts: six empty lists
Numbers = tuple[list[float], list[float], list[float]]
"""Positions [rad, m], velocities [rad/s, m/s] and efforts [N m, N], in the joints' order."""


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
        self._names_on_the_wire = b"".join(whole)
        # The names; of each joint one number, their count in front, three times; and nothing more.
        count, size = len(self.names), len(self._names_on_the_wire)
        self._struct = struct.Struct(f"<{size}s{3 * f'I{count}d'}{len(NOTHING_MORE)}s")

    def read(self) -> Numbers:
        """Positions, velocities and efforts as they are; the caller holds the simulator's lock."""
        joints = self.joints
        return (
            [joint.position for joint in joints],
            [joint.velocity for joint in joints],
            [joint.effort for joint in joints],
        )

    def message(self, now: int, numbers: Numbers | None = None) -> JointState:
        """Their state; `now` [ns]; without numbers as it is."""
        return JointState(Header(stamp=to_time(now)), self.names, *(numbers or self.read()))

    def on_the_wire(self, numbers: Numbers) -> bytes:
        """All that follows the header of their state."""
        positions, velocities, efforts = numbers
        count = len(positions)
        return self._struct.pack(
            self._names_on_the_wire, count, *positions, count, *velocities, count, *efforts,
            NOTHING_MORE,
        )  # fmt: skip


class JointsAnswer(StepWorldResponse):
    """The answer to who asks for joints only; fields are made when they are read: a client gets the bytes."""

    success, status_message = True, ""
    model_names = model_poses = model_twists = link_poses = link_twists = contacts = ()

    def __init__(self, told: ToldJoints, now: int) -> None:
        """`now` [ns]."""
        self._told, self._now, self._numbers = told, now, told.read()

    @property
    def sim_time(self) -> float:
        return self._now / NANOSECONDS

    @property
    def joint_states(self) -> JointState:
        return self._told.message(self._now, self._numbers)

    def serialize(self, buff: BytesIO) -> None:
        now = self._now
        secs, nsecs = divmod(now, NANOSECONDS)
        buff.write(HEAD.pack(True, 0, now / NANOSECONDS, 0, secs, nsecs, 0))
        buff.write(self._told.on_the_wire(self._numbers))


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
