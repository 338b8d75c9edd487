"""Whether a robot's gains are too high for the step of the physics, and what rings for want of damping.

The engines step semi-implicitly, v' = v - dt/M (p x + d v), x' = x + dt v', with the effort of the state before
the step. Such a loop shakes from step to step, and more each time, where an eigenvalue of
M^-1 (p dt² + 2 d dt) is beyond 4; for a loop on velocity, where one of M^-1 (2 p dt + 4 d) is.
"""

import logging
import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.hardware import GAINS, RobotHardware
from bullet_gazebo.control.manager import RUNNING, ControllerManager
from bullet_gazebo.control.pid import Gains, Loop
from bullet_gazebo.physics.mechanics.mass_matrix import mobility, most_inertias, poses_at_zero
from bullet_gazebo.physics.model import Model

Tell = Callable[[int, str], None]
"""Takes what is to be logged: a level of `logging`, and the text."""

MOST = 4.0  # of the eigenvalue
P_ONLY_DAMPING = 0.05  # of critical damping
P_ONLY_TAG = "pOnlyDamping"
CONTROL_PLUGIN = "libgazebo_ros_control.so"


class OwnedLoop(NamedTuple):
    """A loop and whose it is: a controller's, or a drive's."""

    owner: str
    loop: Loop


class StabilityWatch:
    """Looks at the gains of one robot whenever they or its controllers change, and tells once of each fault."""

    def __init__(
        self, model: Model, hardware: RobotHardware, manager: ControllerManager, tell: Tell
    ) -> None:
        """
        Raises:
            ControlError: if the model's `<pOnlyDamping>` is no number from 0 to 1.
        """
        self._model = model
        self._hardware = hardware
        self._manager = manager
        self._tell = tell
        self._damping_ratio = p_only_damping(model)
        self._told: set[object] = set()
        self.shaking: set[str] = set()  # joints that are driven by gains that are too high

    def review(self, period: float) -> None:
        """Warns of gains that are too high, and damps what a P gain alone drives; `period` [s] is that of
        the controllers, or 0 if they are updated on each step."""
        loaded = self._manager.loaded
        drives = [OwnedLoop(GAINS, loop) for loop in self._hardware.loops]
        acting = drives + _owned(c for c in loaded if c.state == RUNNING)
        groups = [acting, *(_owned([c]) for c in loaded if c.state != RUNNING)]
        found = [self._too_high(group, max(period, self._model.time_step)) for group in groups]
        self.shaking = {each.loop.joint for each, _ in found[0]}
        for group in found:
            self._warn_of(group, max(period, self._model.time_step))
        self._damp(acting)

    def blown_up(self, joints: Iterable[str], speed: float) -> None:
        """Tells, once of each, that `joints` have reached `speed` [rad/s, m/s], and what drives them."""
        step = self._model.time_step
        for name in joints:
            if name in self._told:
                continue
            self._told.add(name)
            running = _owned(c for c in self._manager.loaded if c.state == RUNNING)
            owned = [each for each in running if each.loop.joint == name]
            owned += [OwnedLoop(GAINS, lp) for lp in self._hardware.loops if lp.joint == name]
            driver = "no controller with gains drives it"
            if owned:
                driver = f"{owned[0].owner} drives it with {_gains(owned[0].loop.pid.gains)}"
            self._tell(
                logging.WARNING,
                f"joint '{name}' of model '{self._model.name}' blew up: it went half a turn in a step "
                f"({speed:.0f} rad/s or m/s; the step is {step:g} s). It was slowed down. "
                f"{driver[0].upper()}{driver[1:]}. Lower gains, a shorter step or heavier links help.",
            )

    def _warn_of(self, found: list[tuple[OwnedLoop, float]], dt: float) -> None:
        for (owner, loop), excess in found:
            gains = loop.pid.gains
            key = (owner, loop.joint, gains, dt)
            if key in self._told:
                continue
            self._told.add(key)
            p, d = _terms(loop, dt)
            name, value = ("d", gains.d) if d > p else ("p", gains.p)
            self._tell(
                logging.WARNING,
                f"{owner} drives joint '{loop.joint}' of model '{self._model.name}' with {name} = {value:g}, "
                f"{excess:.3g} times what a step of {dt:g} s can follow (about {value / excess:.3g}): it will "
                "shake. Lower the gain, or take a shorter step.",
            )

    def _too_high(self, group: list[OwnedLoop], dt: float) -> list[tuple[OwnedLoop, float]]:
        """The loops that shake, and how many times too high their gains are: first the worst."""
        model, found = self._model, []
        left = {each.loop.joint: each for each in group if sum(_terms(each.loop, dt)) > 0.0}
        left = {name: each for name, each in left.items() if name in model.joint_names}
        if not left:
            return []
        dampings = {n: j.damping for n, j in model.description.joints.items() if n in left}
        implicit = model.body.implicit_damping
        added = {n: c * dt / 2.0 for n, c in dampings.items()} if implicit else {}
        matrix = mobility(model.description, poses_at_zero(model.description), added)
        order = [joint.name for joint in model.description.movable_joints]
        while left:
            places = [order.index(name) for name in left]
            stiffness = [sum(_terms(each.loop, dt)) for each in left.values()]
            if not implicit:
                stiffness = [
                    s + min(2.0 * dampings[n] * dt, 1.0 / matrix[i, i])
                    for s, n, i in zip(stiffness, left, places, strict=True)
                ]
            root = np.sqrt(np.array(stiffness))
            values, vectors = np.linalg.eigh(root[:, None] * matrix[np.ix_(places, places)] * root)
            if not values[-1] >= MOST:
                break
            worst = list(left)[int(np.argmax(np.abs(vectors[:, -1])))]
            found.append((left.pop(worst), float(values[-1]) / MOST))
        return found

    def _damp(self, acting: list[OwnedLoop]) -> None:
        """Gives joints that a P gain alone drives some damping: nothing else would ever still them."""
        model, added = self._model, {}
        loops = [each for each in acting if self._damping_ratio and _rings(each.loop, model)]
        if loops:
            inertias = most_inertias(model.description)
            for owner, loop in loops:
                stiffness = loop.pid.gains.p * inertias[loop.joint]
                added[loop.joint] = float(2.0 * self._damping_ratio * math.sqrt(stiffness))
                if (owner, loop.joint) not in self._told:
                    self._told.add((owner, loop.joint))
                    self._tell(
                        logging.INFO,
                        f"{owner} drives joint '{loop.joint}' of model '{model.name}' with p alone: it gets "
                        f"{self._damping_ratio:g} of critical damping, unless <{P_ONLY_TAG}> of the plugin "
                        "or <dynamics damping> of the joint say otherwise",
                    )
        model.add_damping(added)


def p_only_damping(model: Model) -> float:
    """Returns the share of critical damping for joints that a P gain alone drives: `<pOnlyDamping>` of the
    model's control plugin.

    Raises:
        ControlError: if it is no number from 0 to 1.
    """
    for plugin in model.description.plugins:
        text = plugin.element.findtext(P_ONLY_TAG)
        if text is None or not plugin.filename.endswith(CONTROL_PLUGIN):
            continue
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0.0 <= value <= 1.0:
            raise ControlError(f"<{P_ONLY_TAG}> '{text}' is not a number from 0 to 1")
        return value
    return P_ONLY_DAMPING


def _owned(controllers: Iterable[Controller]) -> list[OwnedLoop]:
    return [OwnedLoop(f"controller '{c.name}'", loop) for c in controllers for loop in c.loops]


def _terms(loop: Loop, dt: float) -> tuple[float, float]:
    """What p and d of a loop add to its stiffness [kg m², kg] in steps of `dt` [s]."""
    p, d = max(loop.pid.gains.p, 0.0), max(loop.pid.gains.d, 0.0)
    return (2.0 * p * dt, 4.0 * d) if loop.of_velocity else (p * dt * dt, 2.0 * d * dt)


def _rings(loop: Loop, model: Model) -> bool:
    joint, gains = model.description.joints.get(loop.joint), loop.pid.gains
    return (
        joint is not None
        and not loop.of_velocity
        and gains.p > 0.0
        and gains.d == 0.0
        and joint.damping == joint.friction == 0.0
        and loop.joint in model.joint_names
    )


def _gains(gains: Gains) -> str:
    return f"p = {gains.p:g}, i = {gains.i:g}, d = {gains.d:g}"
