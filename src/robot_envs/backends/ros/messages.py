"""Converts between ROS messages and what tasks see of a robot and its world."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from geometry_msgs.msg import Point, Quaternion, Twist, Vector3
from geometry_msgs.msg import Pose as PoseMsg

from bullet_gazebo.physics.pose import Pose, Vector
from robot_envs.errors import SimulatorFault
from robot_envs.scene import Scene
from robot_envs.world_state import ContactPair, Joints, JointState, Motion

if TYPE_CHECKING:  # a world in real time doesn't need them
    from bullet_gazebo_msgs.srv import StepWorldRequest
    from gazebo_msgs.msg import ContactState
    from sensor_msgs.msg import JointState as JointStateMsg

_MOTION = 13  # numbers of a link or model in PreparedStep.srv


class JointStateReader:
    """Reads a scene's joints from joint states, whose names may be plain or model::joint.

    Args:
        scene: the robots.
    """

    def __init__(self, scene: Scene) -> None:
        self._wanted = {
            scene.joint(robot, name): (name, f"{robot.model}::{name}", scene.several)
            for robot in scene.robots
            for name in robot.joints
        }
        self._names: Sequence[str] = []  # of the message before
        self._places: list[tuple[str, int]] = []

    def __call__(self, message: JointStateMsg) -> Joints:
        """Returns the joints of a message. See `read`."""
        return self.read(message.name, message.position, message.velocity, message.effort)

    def read(
        self,
        names: Sequence[str],
        positions: Sequence[float],
        velocities: Sequence[float],
        efforts: Sequence[float],
    ) -> Joints:
        """Returns the joints under the names that they have in a state.

        Raises:
            SimulatorFault: if a joint is missing or a value isn't finite.
        """
        if names != self._names:
            self._places = self._found(names)
            self._names = names
        total, joints = 0.0, Joints()
        try:
            for name, index in self._places:
                position, velocity = positions[index], velocities[index]
                effort = efforts[index] if efforts else 0.0
                joints[name] = JointState(position, velocity, effort)
                total += position + velocity
        except IndexError:
            raise SimulatorFault(f"a joint state has fewer numbers than names: {names}") from None
        if not math.isfinite(total):
            raise SimulatorFault(f"the joint state isn't finite: {joints}")
        return joints

    def _found(self, names: Sequence[str]) -> list[tuple[str, int]]:
        places, missing = [], []
        for key, (plain, full, several) in self._wanted.items():
            if full in names:
                places.append((key, names.index(full)))
            elif plain in names and not several:
                places.append((key, names.index(plain)))
            else:
                missing.append(key)
        if missing:
            raise SimulatorFault(
                f"the joint state lacks {' and '.join(missing)}; it has: {list(names)}"
            )
        return places


def fill_models(request: StepWorldRequest, placed: Mapping[str, Motion]) -> None:
    """Makes a request place models."""
    request.models = list(placed)
    motions = placed.values()
    request.poses = [PoseMsg(Point(*at.position), Quaternion(*at.orientation)) for at, _ in motions]
    request.twists = [Twist(Vector3(*line), Vector3(*turn)) for _, (line, turn) in motions]


def motions_of(numbers: Sequence[float]) -> Iterator[Motion]:
    """Reads links and models from the numbers of a prepared step."""
    for i in range(0, len(numbers), _MOTION):
        x, y, z, qx, qy, qz, qw, vx, vy, vz, wx, wy, wz = numbers[i : i + _MOTION]
        yield Motion(Pose((x, y, z), (qx, qy, qz, qw)), ((vx, vy, vz), (wx, wy, wz)))


def pose_of(message: PoseMsg) -> Pose:
    """Reads a pose."""
    place, turn = message.position, message.orientation
    return Pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))


def contact_of(state: ContactState) -> ContactPair:
    """Reads what touches."""
    return ContactPair(
        state.collision1_name,
        state.collision2_name,
        _vectors(state.contact_positions),
        _vectors(state.contact_normals),
        [(_vector(each.force), _vector(each.torque)) for each in state.wrenches],
        list(state.depths),
    )


def _vectors(messages: Iterable[Vector3]) -> list[Vector]:
    return [_vector(each) for each in messages]


def _vector(message: Vector3) -> Vector:
    return (message.x, message.y, message.z)
