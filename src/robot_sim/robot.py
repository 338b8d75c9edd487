"""A controlled robot: the seam between a model of the physics world and its ros_control hardware."""

import logging
from collections.abc import Mapping, Sequence
from math import ceil, isfinite
from typing import Any

from robot_sim.constants import NANOSECONDS
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.manager import ControllerManager
from robot_sim.control.pid import Gains
from robot_sim.physics.description import Plugin
from robot_sim.physics.engine import FURTHEST, STRONGEST
from robot_sim.physics.model import Model
from robot_sim.stability import Log, StabilityWatch

JointStates = Sequence[Sequence[float]]
FAST = 0.999 * FURTHEST  # [rad, m] in a step: only what has blown up moves like that

SLOWEST = 3600.0  # [s]; the longest control period

logger = logging.getLogger(f"rosout.{__name__}")


def control_period_of(plugin: Plugin) -> float:
    """Returns `<controlPeriod>` of a control plugin [s]; 0, which is each step, if there is none.

    Raises ControlError if it isn't a number from 0 to SLOWEST.
    """
    text = (plugin.element.findtext("controlPeriod") or "").strip() or "0"
    try:
        period = float(text)
    except ValueError as error:
        raise ControlError(f"<controlPeriod> '{text}' is not a number") from error
    if not 0.0 <= period <= SLOWEST:
        raise ControlError(f"<controlPeriod> {text} is not within 0 and {SLOWEST:g} s")
    return period


class ControlledRobot:
    """Copies joint states into ros_control's handles, and commands back, once a tick."""

    def __init__(
        self, model: Model, hardware: RobotHardware, manager: ControllerManager,
        control_period: float = 0.0, namespace: str = "/", log: Log = logger.log,
    ) -> None:  # fmt: skip
        """
        Args:
            model: The robot in the world.
            hardware: Its joints as ros_control sees them.
            manager: Of its controllers.
            control_period: Of the controllers [s]; they are updated on each step if that is longer.
            namespace: The manager's, to look up controllers by their full names.
            log: Logs what is wrong with gains.

        Raises:
            ControlError: If the model lacks a joint that a transmission names, or has a wrong setting.
        """
        self.model = model
        self.hardware = hardware
        self.manager = manager
        self.namespace = namespace
        self._control_period = round(control_period * NANOSECONDS)
        # [ns] since the last control tick; None: the next step is one.
        self._waited: int | None = None
        indices = {name: index for index, name in enumerate(model.joint_names)}
        missing = sorted(set(hardware.joints) - set(indices))
        if missing:
            raise ControlError(f"model '{model.name}' has no joint {missing}, which a transmission names")
        self._joints = [(joint, indices[name]) for name, joint in hardware.joints.items()]
        self._effort_joints = [(j, enforce, indices[j.name]) for j, enforce in hardware.enforcers]
        self._drives = [(drive, indices[drive.joint.name]) for drive in hardware.drives]
        self._efforts = [0.0] * len(indices)
        has_pids = any(drive.pid is not None for drive in hardware.drives)
        self._exerts = has_pids or bool(self._effort_joints)  # efforts, not only motor speeds
        moved = {drive.joint.name for drive, _ in self._drives if drive.pid is None}
        # A motor drives its joint at exactly the commanded speed.
        self._watched = [index for name, index in indices.items() if name not in moved]
        self._others = [index for name, index in indices.items() if name not in hardware.joints]
        self.watch = StabilityWatch(model, hardware, manager, log)
        self._read_ahead = False  # whether the handles hold what the next tick begins with
        self.review_gains()
        manager.on_change = self.review_gains
        self.read()
        hardware.relatch()

    def review_gains(self) -> None:
        """Checks gains against the physics step, after either has changed."""
        self._fast = FAST / self.model.time_step
        self._slow = -self._fast
        self._read_ahead = False
        self.watch.review(self._control_period / NANOSECONDS)
        shares = self.watch.shares
        self._softened = [
            (joint, shares[joint.name]) for joint in self.hardware.effort_joints if joint.name in shares
        ]
        for drive in self.hardware.drives:
            drive.share = shares.get(drive.joint.name, 1.0)

    def read(self) -> None:
        """Copies positions and velocities from the engine, and slows joints that have blown up."""
        states, slow, fast = self.model.body.joint_states(), self._slow, self._fast
        calm = True
        for joint, index in self._joints:
            state = states[index]
            joint.position = state[0]
            joint.velocity = speed = state[1]
            if not slow < speed < fast:
                calm = False
        for index in self._others:
            if not slow < states[index][1] < fast:
                calm = False
        if not calm:
            self._contain(states)

    def read_ahead(self) -> None:
        """Reads the state after the last tick of a call that steps the world.

        The next tick begins with the same state and need not read it again, unless something moves the robot
        in between. It matters where each call is of one tick.
        """
        self.model.body.moved = False
        self.read()
        self._read_ahead = True

    def update(self, now: int, dt: float) -> None:
        """Reads the state, and updates the controllers if they are due; `now` [ns], `dt` [s]."""
        if not self._read_ahead or self.model.body.moved:
            self.read()
        self._read_ahead = False
        if self._control_period:
            self._update_in_time(now, round(dt * NANOSECONDS))
        else:
            self.manager.update(now, dt)
            if self._softened:
                self._soften()

    def _soften(self) -> None:
        """Reduces efforts where gains are too high for the step."""
        for joint, share in self._softened:
            joint.command *= share

    def _contain(self, states: JointStates) -> None:
        """Removes energy that came from nowhere, as ODE's solver loses it, and reads the new state."""
        names = self.model.joint_names
        blown = [names[index] for index in self._watched if not abs(states[index][1]) < self._fast]
        self.watch.blown_up(blown, self._fast)
        # A shaking joint keeps half of its speed, which its gains brake in the next step. At rest it would
        # be pushed the same way forever.
        self.model.calm({name: 0.5 if name in self.watch.shares else 0.0 for name in blown})
        states = self.model.body.joint_states()
        for joint, index in self._joints:
            joint.position, joint.velocity = states[index][:2]

    def _update_in_time(self, now: int, step: int) -> None:
        """Updates the controllers each control period, a whole number of steps and always the nominal one."""
        period = max(1, ceil(self._control_period / step)) * step
        self._waited = period if self._waited is None else self._waited + step
        if self._waited >= period:
            self._waited = 0
            self.manager.update(now, period / NANOSECONDS)
            self._soften()

    def write(self, dt: float) -> None:
        """Clips the commands to the joints' limits and applies them for the next step of `dt` [s].

        Done on each step, also between control periods.
        """
        efforts = self._efforts
        for joint, enforce, index in self._effort_joints:
            enforce(joint)
            effort = joint.command
            if not isfinite(effort):  # it would spread to every state of the world
                effort = 0.0
            joint.effort = efforts[index] = effort
        if self.hardware.halted:
            self._halt()
        if self._drives:
            self._drive(dt)
        if self._exerts:
            self.model.body.apply_efforts(efforts)

    def effort_on(self, joint: str) -> float:
        """Returns the effort [N m, N] applied to a movable joint in the last step."""
        return self._efforts[self.model.joint_index(joint)]

    def _halt(self) -> None:
        """Replaces the commands in an emergency stop (docs/contract/gazebo_ros_control.md 6.7)."""
        for joint, _, index in self._effort_joints:
            joint.effort = self._efforts[index] = 0.0
        for drive, _ in self._drives:
            drive.hold()

    def _drive(self, dt: float) -> None:
        """Moves the joints with position and velocity interfaces.

        Between motors of any force and a wall an engine may find no solution: joints would jump in each
        step. So while something pushes one off its command, all motors keep to their effort limits.
        """
        motors, yields = [], False
        for drive, index in self._drives:
            drive.limit(dt)
            if drive.pid is not None:
                drive.joint.effort = self._efforts[index] = drive.effort(dt)
            else:
                motors.append((drive, index, *drive.motor(dt)))
                yields = yields or drive.pushed
        body = self.model.body
        for drive, index, speed, most in motors:
            strongest = drive.strongest if yields else STRONGEST
            body.set_motor(index, speed, min(most, strongest, STRONGEST))

    def joints_moved(self, now: int, relatch: bool) -> None:
        """Reads the state after a service or reset has changed it; `now` [ns].

        With `relatch`, controllers start over, as an episode should.
        """
        self.read()
        self._waited = None
        for drive, _ in self._drives:
            drive.joints_moved()
        if relatch:
            for joint, _ in self._joints:
                joint.effort = 0.0
        self.manager.joints_moved(now, relatch)

    def state_dict(self) -> dict[str, Any]:
        """Returns the state of hardware and controllers."""
        return {
            "waited": self._waited, "efforts": self._efforts.copy(), "watch": self.watch.state_dict(),
            "hardware": self.hardware.state_dict(), "manager": self.manager.state_dict(),
        }  # fmt: skip

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Loads what `state_dict` returned, with the same controllers running."""
        self._waited, self._read_ahead = state["waited"], False
        self._efforts[:] = state["efforts"]
        self.watch.load_state_dict(state["watch"])
        before = self._gains()
        self.hardware.load_state_dict(state["hardware"])
        try:
            self.manager.load_state_dict(state["manager"])
        finally:
            if self._gains() != before:
                self.review_gains()

    def _gains(self) -> list[Gains]:
        loops = [loop for each in self.manager.loaded for loop in each.loops]
        return [loop.pid.gains for loop in (*self.hardware.loops, *loops)]

    def emergency_stop(self, on: bool) -> None:
        """Releases all joints except those with a position interface, which it holds.

        When it ends, controllers start over.
        """
        if on:
            self.hardware.halt()
        elif self.hardware.halted:
            self.hardware.halted = False
            self.manager.restart()
