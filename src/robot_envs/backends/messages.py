"""Between messages and what tasks see of a robot and its world."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from geometry_msgs.msg import Point, Quaternion, Twist, Vector3
from geometry_msgs.msg import Pose as PoseMsg
from sensor_msgs.msg import JointState as JointStateMsg

from bullet_gazebo.physics.pose import Pose, Vector
from robot_envs.errors import SimulatorError
from robot_envs.robot import Robot, State
from robot_envs.world_state import (
    ContactPair,
    JointState,
    Motion,
    StateQuery,
    WorldState,
    link_keys,
)

if TYPE_CHECKING:  # a world in real time needs none of them
    from bullet_gazebo_msgs.srv import StepWorldRequest, StepWorldResponse
    from gazebo_msgs.msg import ContactState


def read_state(robot: Robot[State], message: JointStateMsg) -> State:
    """The robot's joints, as its tasks see them.

    Raises:
        SimulatorError: if a joint is missing or a value isn't finite.
    """
    numbers: list[float] = []
    try:
        for joint in robot.joints:
            index = message.name.index(joint)
            numbers += (message.position[index], message.velocity[index])
    except (ValueError, IndexError):
        raise SimulatorError(
            f"the joint state lacks {' or '.join(robot.joints)}; it has: {list(message.name)}"
        ) from None
    state = robot.state_of(numbers)
    if not math.isfinite(sum(numbers)):
        raise SimulatorError(f"the joint state isn't finite: {state}")
    return state


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
    answer: StepWorldResponse, begun: StepWorldResponse, query: StateQuery, model: str
) -> WorldState:
    """The world as an answer tells it.

    Args:
        answer: to a request that asks for what the query names.
        begun: the answer to the episode's reset.
        query: what the answer tells beside the joints.
        model: the robot, whose joints are told.
    """
    states, own = answer.joint_states, f"{model}::"
    joints = zip(states.name, states.position, states.velocity, states.effort, strict=True)
    passed = states.header.stamp - begun.joint_states.header.stamp
    links = map(_motion, answer.link_poses, answer.link_twists)
    models = map(_motion, answer.model_poses, answer.model_twists)
    return WorldState(
        time=passed.to_nsec() / 1e9,
        joints={
            name.removeprefix(own): JointState(*state)
            for name, *state in joints
            if "::" not in name or name.startswith(own)
        },
        links=dict(zip(link_keys(query), links, strict=True)),
        models=dict(zip(answer.model_names, models, strict=True)),
        contacts=[_contact(each) for each in answer.contacts],
    )


def _motion(pose: PoseMsg, twist: Twist) -> Motion:
    place, turn = pose.position, pose.orientation
    at = Pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
    return Motion(at, (_vector(twist.linear), _vector(twist.angular)))


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
