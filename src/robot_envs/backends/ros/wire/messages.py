"""Between messages and what tasks see of a robot and its world."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from geometry_msgs.msg import Point, Quaternion, Twist, Vector3
from geometry_msgs.msg import Pose as PoseMsg
from sensor_msgs.msg import JointState as JointStateMsg

from bullet_gazebo.physics.pose import Pose, Vector
from bullet_gazebo.state import NOTHING
from robot_envs.errors import SimulatorFault
from robot_envs.scene import Scene
from robot_envs.world_state import (
    Commands,
    ContactPair,
    Joints,
    JointState,
    Links,
    Models,
    Motion,
    StateQuery,
    WorldState,
    link_keys,
)

if TYPE_CHECKING:  # a world in real time needs none of them
    from bullet_gazebo_msgs.srv import StepWorldRequest, StepWorldResponse
    from gazebo_msgs.msg import ContactState


class JointReader:
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
        self._names: list[str] = []  # of the message before
        self._places: list[tuple[str, int]] = []

    def __call__(self, message: JointStateMsg) -> Joints:
        """The joints by the names that they have in a state.

        Raises:
            SimulatorFault: if a joint is missing or a value isn't finite.
        """
        if message.name != self._names:
            self._places = self._found(message.name)
            self._names = message.name
        positions, velocities, efforts = message.position, message.velocity, message.effort
        total, joints = 0.0, Joints()
        try:
            for name, index in self._places:
                position, velocity = positions[index], velocities[index]
                effort = efforts[index] if efforts else 0.0
                joints[name] = JointState(position, velocity, effort)
                total += position + velocity
        except IndexError:
            raise SimulatorFault(f"a joint state has fewer numbers than names: {message}") from None
        if not math.isfinite(total):
            raise SimulatorFault(f"the joint state isn't finite: {joints}")
        return joints

    def _found(self, names: list[str]) -> list[tuple[str, int]]:
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


def ask_for(request: StepWorldRequest, query: StateQuery) -> None:
    """Has a request ask for what a query names."""
    request.model_states, request.model_states_of = query.all_models, list(query.models)
    request.link_states_of = [each.link for each in query.links]
    request.link_frames = [each.frame for each in query.links]
    request.contacts, request.contacts_of = query.all_contacts, list(query.contacts_of)


def place(request: StepWorldRequest, placed: Mapping[str, Motion]) -> None:
    """Has a request place models."""
    request.models = list(placed)
    motions = placed.values()
    request.poses = [PoseMsg(Point(*at.position), Quaternion(*at.orientation)) for at, _ in motions]
    request.twists = [Twist(Vector3(*line), Vector3(*turn)) for _, (line, turn) in motions]


def told(
    answer: StepWorldResponse,
    begun: StepWorldResponse,
    query: StateQuery,
    joints: Joints,
    commands: Commands,
) -> WorldState:
    """The world as an answer tells it.

    Args:
        answer: to a request that asks for what the query names.
        begun: the answer to the episode's reset.
        query: what the answer tells beside the joints.
        joints: those of the answer.
        commands: what the controllers hold.
    """
    now, then = answer.joint_states.header.stamp, begun.joint_states.header.stamp
    passed = ((now.secs - then.secs) * 1_000_000_000 + now.nsecs - then.nsecs) / 1e9  # [s]
    if query == NOTHING:
        return WorldState(passed, joints, commands)
    links = map(_motion, answer.link_poses, answer.link_twists)
    models = map(_motion, answer.model_poses, answer.model_twists)
    return WorldState(
        passed,
        joints,
        commands,
        Links(zip(link_keys(query), links, strict=True)),
        Models(zip(answer.model_names, models, strict=True)),
        [_contact(each) for each in answer.contacts],
    )


def pose_of(message: PoseMsg) -> Pose:
    """The same as a pose of ours."""
    place, turn = message.position, message.orientation
    return Pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))


def _motion(pose: PoseMsg, twist: Twist) -> Motion:
    return Motion(pose_of(pose), (_vector(twist.linear), _vector(twist.angular)))


def _contact(state: ContactState) -> ContactPair:
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
