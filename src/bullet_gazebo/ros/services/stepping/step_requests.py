"""Checks a StepWorld request as a whole, before any of it is carried out."""

import math
from collections.abc import Sequence

from bullet_gazebo_msgs.srv import PrepareStepRequest, StepWorldRequest

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.model import AT_REST, Model
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.ros.common.messages import LARGEST, bad_number, from_pose_msg, from_twist_msg
from bullet_gazebo.ros.services.stepping.addresses import Addresses
from bullet_gazebo.simulator import Simulator
from bullet_gazebo.state import NOTHING, LinkQuery, StateQuery, find_model

MAX_TICKS = 1_000_000  # more than this is a mistake and would take minutes
Placing = tuple[dict[str, float], dict[str, float]]
"""Positions [rad, m] and velocities [rad/s, m/s] of joints by plain name."""


class StepPlan:
    """The models and joints to place, the commands, and the question of a StepWorld request."""

    def __init__(self, sim: Simulator, request: StepWorldRequest, addresses: Addresses) -> None:
        """Checks the request; the caller holds the simulator's lock.

        Raises:
            ControlError: if the request can't be carried out; the text says why.
            UnknownName: for a model that doesn't exist.
        """
        self.query = query_of(request)
        _check_ticks(request, self.query is not NOTHING)
        self.placed_models = _placed_models(sim, request)
        self.placed_joints = _placed_joints(addresses, request)
        check_numbers("commands", request.commands)
        _check_list(
            "commanded_joints", request.commanded_joints, "joint_commands", request.joint_commands
        )
        self.commanded = addresses.commanded(request.controllers, request.commanded_joints)
        if self.commanded.size != len(request.commands):
            raise ControlError(
                f"{len(request.controllers)} controllers but {len(request.commands)} commands"
            )


def query_of(request: StepWorldRequest | PrepareStepRequest) -> StateQuery:
    """Returns what a request asks for beside the joints.

    Raises:
        ControlError: if links and frames don't go together.
    """
    links, frames = request.link_states_of, request.link_frames
    if not (
        links or frames or request.contacts or request.contacts_of
        or request.model_states or request.model_states_of
    ):  # fmt: skip
        return NOTHING
    frames = frames or [""] * len(links)
    if len(links) != len(frames):
        raise ControlError(f"{len(links)} link_states_of but {len(frames)} link_frames")
    return StateQuery(
        models=tuple(request.model_states_of),
        all_models=request.model_states,
        links=tuple(map(LinkQuery, links, frames)),
        contacts_of=tuple(request.contacts_of),
        all_contacts=request.contacts,
    )


def check_numbers(what: str, values: Sequence[float]) -> None:
    """Refuses numbers that no world can hold.

    Raises:
        ControlError: for a number that isn't finite or is too large.
    """
    if all(map(math.isfinite, values)) and max(map(abs, values), default=0.0) <= LARGEST:
        return
    for value in values:
        if not math.isfinite(value):
            raise ControlError(f"{what} has {value}, which is not finite")
        if abs(value) > LARGEST:
            raise ControlError(f"{what} has {value}; it can't be beyond {LARGEST:g}")


def _placed_models(sim: Simulator, request: StepWorldRequest) -> list[tuple[Model, Pose, Twist]]:
    names, poses, twists = request.models, request.poses, request.twists
    if not names and not poses and not twists:
        return []
    _check_lengths("models", names, "poses", poses)
    if twists:
        _check_lengths("models", names, "twists", twists)
    for what, messages in (("poses", poses), ("twists", twists)):
        for index, message in enumerate(messages):
            fault = bad_number(message)
            if fault:
                raise ControlError(f"{what}[{index}].{fault}")
    models = [find_model(sim.world, name) for name in names]
    speeds = [from_twist_msg(twist) for twist in twists] or [AT_REST] * len(models)
    return list(zip(models, map(from_pose_msg, poses), speeds, strict=True))


def _placed_joints(addresses: Addresses, request: StepWorldRequest) -> dict[Model, Placing]:
    names, velocities = request.joints, request.velocities or [0.0] * len(request.joints)
    _check_list("joints", names, "positions", request.positions)
    _check_list("joints", names, "velocities", velocities)
    joints = addresses.movable_joints(names)
    placed: dict[Model, Placing] = {}
    for place, position, velocity in zip(joints, request.positions, velocities, strict=True):
        positions, speeds = placed.setdefault(place[0], ({}, {}))
        positions[place[1]] = position
        speeds[place[1]] = velocity
    return placed


def _check_ticks(request: StepWorldRequest, asks: bool) -> None:
    begins = request.reset != StepWorldRequest.NONE or bool(request.joints or request.models)
    if not (0 if begins or asks else 1) <= request.ticks <= MAX_TICKS:
        raise ControlError(
            f"ticks is {request.ticks}: 1 to {MAX_TICKS} can be done in one call"
            + (", or 0 with a reset, a placing or a question" if request.ticks == 0 else "")
        )
    if request.reset > StepWorldRequest.SIMULATION:
        raise ControlError(f"reset is {request.reset}: 0 (none), 1 (world) or 2 (simulation)")
    if request.seed and request.reset == StepWorldRequest.NONE:
        raise ControlError(f"seed is {request.seed}, which goes with a reset only")


def _check_list(names: str, one: Sequence[str], values: str, other: Sequence[float]) -> None:
    _check_lengths(names, one, values, other)
    check_numbers(values, other)


def _check_lengths(names: str, one: Sequence[str], values: str, other: Sequence[object]) -> None:
    if len(one) != len(other):
        raise ControlError(f"{len(one)} {names} but {len(other)} {values}")
    if len(set(one)) < len(one):
        raise ControlError(f"{names} names one twice: {list(one)}")
