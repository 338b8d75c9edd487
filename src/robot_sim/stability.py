"""Stability of gains at the physics step, and damping of joints that a P gain alone would let ring.

The engines step semi-implicitly, v' = v - dt/M (p x + d v), x' = x + dt v', with the effort of the state
before the step. Such a loop diverges, alternating from step to step, if an eigenvalue of
M^-1 (p dt² + 2 d dt) exceeds 4; a loop on velocity diverges if one of M^-1 (2 p dt + 4 d) does. The effort of
a loop that does is divided by 1 + (p dt² + d dt) / M or 1 + (p dt + 2 d) / M, as an implicit step would do.
"""

import logging
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from robot_sim.control.controllers.base import Controller
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import GAINS, RobotHardware
from robot_sim.control.manager import RUNNING, ControllerManager
from robot_sim.control.pid import Loop
from robot_sim.physics.description import is_control_plugin
from robot_sim.physics.dynamics import mobility, most_inertias, poses_at_zero
from robot_sim.physics.engine import Contact
from robot_sim.physics.model import SOFTEST, Model
from robot_sim.state_dict import Stateful

Log = Callable[[int, str], None]
"""Logs a text at a level of `logging`."""

MOST = 4.0  # of the eigenvalue
P_ONLY_DAMPING = 0.05  # of critical damping
P_ONLY_TAG = "pOnlyDamping"
STILL = 1e-3  # [rad, m] by which a stalled joint may move
OFF = 0.05  # [rad, m] of a stalled joint to its goal, and that it may move, if its motor isn't at the limit
STALLED = 1_000_000_000  # [ns]


class OwnedLoop(NamedTuple):
    """A loop, and the controller or drive that it belongs to."""

    owner: str
    loop: Loop


class StabilityWatch(Stateful):
    """Checks a robot's gains whenever they or its controllers change, and logs each fault once."""

    non_persistent = ("_manager", "_log", "_logged", "shares")

    def __init__(self, model: Model, hardware: RobotHardware, manager: ControllerManager, log: Log) -> None:
        """
        Raises:
            ControlError: If the model's `<pOnlyDamping>` isn't a number from 0 to 1.
        """
        self.shares: dict[str, float] = {}  # of efforts, for joints whose gains are too high
        self._model = model
        self._hardware = hardware
        self._manager = manager
        self._log = log
        self._damping_ratio = p_only_damping(model)
        self._logged: set[object] = set()
        self._pushing: dict[str, tuple[int, float]] = {}  # since when [ns] and where [rad, m]

    def review(self, period: float) -> None:
        """Warns of gains that are too high, and damps joints that a P gain alone drives.

        `period` is the controllers' [s]; 0 if they are updated on each step.
        """
        dt = max(period, self._model.time_step)
        acting = self._acting()
        found = too_high(self._model, acting, dt)
        self.shares = {each.loop.joint: share for each, _, share in found}
        for controller in self._manager.loaded:
            if controller.state != RUNNING:
                found += too_high(self._model, _owned([controller]), dt)
        for each, excess, _ in found:
            self._warn_of(each, excess, dt)
        self._damp(acting)

    def blown_up(self, joints: Iterable[str], speed: float) -> None:
        """Logs, once for each joint, that it has reached `speed` [rad/s, m/s], and what drives it."""
        for name in joints:
            if name in self._logged:
                continue
            self._logged.add(name)
            driver = "No controller with gains drives it"
            for owner, loop in self._acting():
                if loop.joint == name:
                    gains = loop.pid.gains
                    driver = f"The {owner} drives it with p = {gains.p:g}, i = {gains.i:g}, d = {gains.d:g}"
            self._log(
                logging.WARNING,
                f"joint '{name}' of model '{self._model.name}' blew up: it went half a turn in a step "
                f"({speed:.0f} rad/s or m/s; the step is {self._model.time_step:g} s). It was slowed down. "
                f"{driver}. Lower gains, a shorter step or heavier links help.",
            )

    def report_stalls(self, now: int, contacts: Callable[[], Sequence[Contact]]) -> None:
        """Logs, once for each joint, that a contact has stalled its motor for a second; `now` [ns].

        A motor may well press on another model, as a gripper does, so that is no warning. One that doesn't
        give all it has, its gains being low or softened, is stalled if its own model holds it off its goal.
        """
        joints = self._hardware.joints
        full = [each.name for each in self._hardware.at_their_limits()]
        held = dict.fromkeys(full, "its motor at the limit")
        for _, loop in self._acting():
            off = 0.0 if loop.of_velocity else loop.pid.p_error
            if loop.joint in joints and abs(off) > OFF:
                held.setdefault(loop.joint, f"{abs(off):.2g} rad or m off its goal")
        pushing = {}
        touching: Sequence[Contact] | None = None
        for name, how in held.items():
            position = joints[name].position
            since, place = self._pushing.get(name, (now, position))
            # What its own links hold may creep or tremble.
            if now < since or abs(position - place) > (STILL if name in full else OFF):
                since, place = now, position
            pushing[name] = since, place
            if now - since < STALLED or ("stalled", name) in self._logged:
                continue
            touching = contacts() if touching is None else touching
            for own, text in self._stops(name, how, touching):
                if own or name in full:
                    self._logged.add(("stalled", name))
                    self._log(logging.WARNING if own else logging.INFO, text)
                    break
        self._pushing = pushing

    def _stops(self, joint: str, how: str, contacts: Sequence[Contact]) -> Iterator[tuple[bool, str]]:
        """Yields for each contact that stops a joint whether it is of two links of the model, and a text."""
        model = self._model
        carried = {link for link in model.link_names if joint in model.carriers(link)}
        for contact in contacts:
            sides = (contact.first, contact.second)
            moved = [side.body is model.body and side.link in carried for side in sides]
            if sum(moved) == 1:
                link, other = sides if moved[0] else sides[::-1]
                own = other.body is model.body
                yield (
                    own,
                    f"joint '{joint}' of model '{model.name}' has been stalled for a second, {how}: "
                    f"link '{link.link}' touches link '{other.link}' of "
                    f"{'its own' if own else 'another'} model",
                )

    def _acting(self) -> list[OwnedLoop]:
        drives = [OwnedLoop(f"drive '{GAINS}/{each.joint}'", each) for each in self._hardware.loops]
        return drives + _owned(c for c in self._manager.loaded if c.state == RUNNING)

    def _warn_of(self, each: OwnedLoop, excess: float, dt: float) -> None:
        owner, loop = each
        key = (owner, loop.joint, loop.pid.gains, dt)
        if key in self._logged:
            return
        self._logged.add(key)
        p, d = _stiffness(loop, dt)
        gain, value = ("d", loop.pid.gains.d) if d > p else ("p", loop.pid.gains.p)
        self._log(
            logging.WARNING,
            f"{owner} drives joint '{loop.joint}' of model '{self._model.name}' with {gain} = {value:g}, "
            f"{excess:.3g} times what a step of {dt:g} s can follow (about {value / excess:.3g}): "
            "it would shake, so its effort is softened. Lower the gain, or take a shorter step.",
        )

    def _damp(self, acting: list[OwnedLoop]) -> None:
        """Adds damping to joints that a P gain alone drives: nothing else would ever stop them."""
        added = {}
        loops = [each for each in acting if self._damping_ratio and _rings(each.loop, self._model)]
        inertias = most_inertias(self._model.description) if loops else {}
        for owner, loop in loops:
            critical = 2.0 * math.sqrt(loop.pid.gains.p * inertias[loop.joint])
            added[loop.joint] = self._damping_ratio * critical
            if (owner, loop.joint) not in self._logged:
                self._logged.add((owner, loop.joint))
                self._log(
                    logging.INFO,
                    f"{owner} drives joint '{loop.joint}' of model '{self._model.name}' with p alone: it "
                    f"gets {self._damping_ratio:g} of critical damping, unless <{P_ONLY_TAG}> of the plugin "
                    "or <dynamics damping> of the joint say otherwise",
                )
        self._model.add_damping(added)


def too_high(model: Model, loops: list[OwnedLoop], dt: float) -> list[tuple[OwnedLoop, float, float]]:
    """Returns the loops whose gains are too high for steps of `dt` [s], the worst first.

    Each comes with the factor by which it is too high, and the share of its effort to take. Inertias are
    those with all joints at zero.
    """
    left = {each.loop.joint: each for each in loops if sum(_stiffness(each.loop, dt)) > 0.0}
    order = [joint.name for joint in model.description.movable_joints]
    left = {name: left[name] for name in order if name in left}
    if not left:
        return []
    own = {name: model.description.joints[name].damping * dt for name in left}
    implicit = model.body.implicit_damping
    added = {name: damping / 2.0 for name, damping in own.items()} if implicit else {}
    matrix = mobility(model.description, poses_at_zero(model.description), added)
    stiffness = {name: math.fsum(_stiffness(each.loop, dt)) for name, each in left.items()}
    if not implicit:  # Model.apply_damping cuts it at half of what stops the joint in one step
        for name in left:
            place = order.index(name)
            stiffness[name] += min(2.0 * own[name], 1.0 / matrix[place, place])
    for name in left:
        place = order.index(name)
        spring = model.description.joints[name].spring_stiffness * dt * dt
        most = SOFTEST / float(matrix[place, place])
        # Model.apply_damping cuts it there, and damps it.
        stiffness[name] += spring if spring <= most else 3.0 * most
    found = []
    while left:
        places = [order.index(name) for name in left]
        root = np.sqrt([stiffness[name] for name in left])
        values, vectors = np.linalg.eigh(root[:, None] * matrix[np.ix_(places, places)] * root)
        if not values[-1] >= MOST:
            break
        worst = list(left)[int(np.argmax(np.abs(vectors[:, -1])))]
        each = left.pop(worst)
        p, d = _stiffness(each.loop, dt)
        own_part = (p + d) / 2.0 if each.loop.of_velocity else p + d / 2.0
        place = order.index(worst)
        share = 1.0 / (1.0 + own_part * float(matrix[place, place]))
        found.append((each, float(values[-1]) / MOST, share))
    return found


def p_only_damping(model: Model) -> float:
    """Returns `<pOnlyDamping>` of the model's control plugin: a share of critical damping."""
    for plugin in model.description.plugins:
        text = plugin.element.findtext(P_ONLY_TAG)
        if text is None or not is_control_plugin(plugin.filename):
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


def _stiffness(loop: Loop, dt: float) -> tuple[float, float]:
    """Returns what p and d of a loop add to M times the eigenvalue [kg m², kg], in steps of `dt` [s]."""
    p, d = max(loop.pid.gains.p, 0.0), max(loop.pid.gains.d, 0.0)
    return (2.0 * p * dt, 4.0 * d) if loop.of_velocity else (p * dt * dt, 2.0 * d * dt)


def _rings(loop: Loop, model: Model) -> bool:
    gains = loop.pid.gains
    if loop.of_velocity or not gains.p > 0.0 or gains.d or loop.joint not in model.joint_names:
        return False
    joint = model.description.joints[loop.joint]
    return joint.damping == joint.friction == 0.0
