"""What a command is kept within, and what it is when a robot has to stop."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from bullet_gazebo.control.joint import JointLimits
from robot_envs.description.controllers import CommandPort
from robot_envs.robot import Robot
from robot_envs.world_state import Command, JointState


class Limited(NamedTuple):
    """A command within its limits."""

    command: Command
    beyond: tuple[str, ...]  # joints whose command was beyond the URDF's bounds


class CommandLimits:
    """Keeps the commands of a controller within what the URDF says of its joints.

    | command | stays within |
    |---|---|
    | position | `lower` and `upper`, and the soft ones; and goes from one to the next at `velocity` at most |
    | velocity | `velocity` either way |
    | effort | `effort` either way |

    Args:
        robot: has the limits.
        port: of the controller.
        way: how far a position may go from one command to the next, as a share of what the joint's
            velocity limit allows meanwhile; infinity: as far as it likes.
        period: from one command to the next [s].
    """

    def __init__(self, robot: Robot, port: CommandPort, way: float, period: float) -> None:
        self._port = port
        limits = [robot.limits[joint] for joint in port.joints]
        self._bounds = [_bounds(each, port.quantity) for each in limits]
        moves = port.quantity == "position"
        self._ways = [
            each.velocity * way * period if moves and each.velocity else math.inf for each in limits
        ]

    def __call__(self, command: Command, held: Command) -> Limited:
        """The nearest one that is allowed after the one that is held."""
        beyond, numbers = [], []
        wanted, before = self._numbers(command), self._numbers(held)
        for joint, value, start, (lower, upper), way in zip(
            self._port.joints, wanted, before, self._bounds, self._ways, strict=True
        ):
            bounded = min(max(value, lower), upper)
            if bounded != value:
                beyond.append(joint)
            numbers.append(min(max(bounded, start - way), start + way))
        return Limited(numbers[0] if self._port.single else tuple(numbers), tuple(beyond))

    def _numbers(self, command: Command) -> list[float]:
        return [command] if self._port.single else list(command)  # type: ignore[list-item, arg-type]

    def stop(self, joints: Mapping[str, JointState]) -> Command:
        """What has the joints stop: positions where they are, or no velocity, or no effort."""
        return self._port.at_start({name: each.position for name, each in joints.items()})


def _bounds(limits: JointLimits, quantity: str) -> tuple[float, float]:
    if quantity != "position":
        most = limits.velocity if quantity == "velocity" else limits.effort
        return (-math.inf, math.inf) if most is None else (-most, most)
    soft = limits.soft
    lower = [each for each in (limits.lower, soft.lower if soft else None) if each is not None]
    upper = [each for each in (limits.upper, soft.upper if soft else None) if each is not None]
    return max(lower, default=-math.inf), min(upper, default=math.inf)
