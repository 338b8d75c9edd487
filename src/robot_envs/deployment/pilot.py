"""The control loop of task and policy, step by step, within limits; without ROS or a clock."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from robot_envs import checks
from robot_envs.controllers import TWIST, CommandPort
from robot_envs.deployment.kinematics import LinkView
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.task import GoalTask, Task, Unrewarded
from robot_envs.world_state import ODOMETRY, Command, JointState, Models, Sensors, StateQuery, WorldState
from robot_sim.control.joint import JointLimits


class CommandLimits:
    """Keeps a controller's commands within its own limits, or the URDF's of its joints (docs/deploying.md).

    `way` is the largest move of a position from one command to the next, `period` later [s], as a share of
    what the joint's velocity limit allows; infinity: no limit.
    """

    def __init__(self, robot: Robot, port: CommandPort, way: float, period: float) -> None:
        self._port = port
        limits = [] if port.quantity == TWIST else [robot.limits[joint] for joint in port.joints]
        self._bounds = list(port.bounds) or [_bounds(each, port.quantity) for each in limits]
        moves = port.quantity == "position"
        self._ways = [
            each.velocity * way * period if moves and each.velocity else math.inf for each in limits
        ] or [math.inf for _ in self._bounds]

    def __call__(self, command: Command, held: Command) -> tuple[Command, list[str]]:
        """Returns the nearest command that is allowed after the present one, and the joints out of bounds."""
        wanted, before = self._numbers(command), self._numbers(held)
        named = zip(self._port.joints, wanted, self._bounds, strict=True)
        exceeded = [joint for joint, value, (low, high) in named if not low <= value <= high]
        moves = zip(wanted, before, self._ways, strict=True)
        near = [min(max(value, start - way), start + way) for value, start, way in moves]
        return self._bounded(near), exceeded  # last, whatever it starts from

    def _numbers(self, command: Command) -> list[float]:
        return self._port.kind.numbers(command)

    def stop(self, joints: Mapping[str, JointState]) -> Command:
        """Returns the command that stops the joints, within their stops: zero, or their present positions."""
        command = self._port.at_start({name: each.position for name, each in joints.items()})
        return self._bounded(self._numbers(command))

    def _bounded(self, numbers: list[float]) -> Command:
        """Returns the nearest command within the bounds."""
        bounds = zip(numbers, self._bounds, strict=True)
        bounded = tuple(min(max(value, lower), upper) for value, (lower, upper) in bounds)
        return bounded[0] if self._port.single else bounded


def _bounds(limits: JointLimits, quantity: str) -> tuple[float, float]:
    if quantity != "position":
        most = limits.velocity if quantity == "velocity" else limits.effort
        return (-math.inf, math.inf) if most is None else (-most, most)
    soft = limits.soft
    lower = [each for each in (limits.lower, soft.lower if soft else None) if each is not None]
    upper = [each for each in (limits.upper, soft.upper if soft else None) if each is not None]
    return max(lower, default=-math.inf), min(upper, default=math.inf)


MARGIN = 0.1  # of a joint's range, that it may be beyond its stops
LEAST_MARGIN = 0.05  # [rad, m]
FASTEST = 10.0  # times its velocity limit, which a joint that is pushed may exceed
LARGEST_STATE = 1e6  # [rad, m, rad/s, m/s] that any joint may have


def impossible(limits: JointLimits, position: float, velocity: float) -> str:
    """Returns why no joint with these limits has this state [rad or m, and 1/s]; empty if one may have it."""
    if not (abs(position) <= LARGEST_STATE and abs(velocity) <= LARGEST_STATE):  # NaN, too
        return f"position {position:g} and velocity {velocity:g}, which no joint has"
    lower, upper = limits.lower, limits.upper
    if lower is not None and upper is not None:
        margin = max(MARGIN * (upper - lower), LEAST_MARGIN)
        if not lower - margin <= position <= upper + margin:
            return f"position {position:g}, beyond its stops at {lower:g} and {upper:g}"
    if limits.velocity and abs(velocity) > FASTEST * limits.velocity:
        return f"velocity {velocity:g}, where its limit is {limits.velocity:g}"
    return ""


Joints = Mapping[str, JointState]
Say = Callable[[str], None]
NO_SENSORS = Sensors()


class Pilot:
    """Runs a policy on a task, as in an environment, from the robot's joint states and sensors.

    Calls all methods of the task as an environment does, even its reward, so that the task stores the same
    data as in training; of one with a `reward_query` it calls neither `reward` nor `is_terminal`. Joints
    aren't moved to the task's initial state. `act` returns the action for an observation, once in a period
    [s]; `seed` is of what the task draws, such as a goal if none is given; `way` is that of `CommandLimits`;
    `say` reports commands beyond these, once for each controller. Raises RobotEnvError if the robot's
    description is wrong, or the task asks for what joints don't determine; ValueError if the goal isn't one
    of the task's.
    """

    def __init__(
        self, robot: Robot, task: Task, act: Callable[[Any], Any], period: float, seed: int = 0,
        goal: Any = None, way: float = 1.0, say: Say = print,
    ) -> None:  # fmt: skip
        self._scene, self._task, self._act, self._say = Scene([robot]), task, act, say
        if not robot.ports:
            raise RobotEnvError(f"the robot '{robot.model}' has no controller that takes commands")
        self._evaluator = task if task.reward_query == StateQuery() else Unrewarded()
        self._links, self._model = LinkView(robot, task.query), robot.model
        self._limits = {port.name: CommandLimits(robot, port, way, period) for port in robot.ports}
        self._read_action = checks.action_reader(checks.made_space(task, "action_space"))
        self._read = checks.observation_reader(
            checks.made_space(task, "observation_space"), type(task).__name__
        )
        self._generator = np.random.default_rng(seed)
        self._reported: set[str] = set()
        self._held: dict[str, Command] = {}
        self._action: Any = None  # None: no step yet
        self._goal: Any = None  # as given
        if goal is not None:
            self.aim(goal)

    def begin(self, joints: Joints, sensors: Sensors = NO_SENSORS) -> None:
        """Begins an episode; commands start from the joints' positions."""
        self._task.initial_state(self._generator)
        self._action = None
        self.go_on(joints)
        task = self._task
        if isinstance(task, GoalTask):
            checks.set_goal(task, self._state(0.0, joints, sensors), self._generator, self._goal)
        elif self._goal is not None:
            task.aim(self._goal)

    def aim(self, goal: Any) -> None:
        """Gives the task a goal for all episodes; raises ValueError if it isn't one of its goals."""
        task = self._task
        if isinstance(task, GoalTask):
            task.desired = self._goal = checks.checked_goal(task, goal)
        else:
            task.aim(goal)
            self._goal = goal

    def go_on(self, joints: Joints) -> None:
        """Continues from the joints' positions, after they were stopped."""
        self._held = {name: limits.stop(joints) for name, limits in self._limits.items()}

    def _state(self, time: float, joints: Joints, sensors: Sensors) -> WorldState:
        motion = sensors.get(ODOMETRY)
        models = Models() if motion is None else Models({self._model: motion.values[ODOMETRY]})
        return WorldState(time, joints, dict(self._held), self._links(joints), models, sensors=sensors)

    def step(self, time: float, joints: Joints, sensors: Sensors = NO_SENSORS) -> dict[str, Command] | None:
        """Returns commands for a time since the beginning [s]; None if the task's episode would end."""
        task, state = self._task, self._state(time, joints, sensors)
        over = self._evaluator.is_terminal(state)
        if self._action is not None:
            self._evaluator.reward(state, self._action)
        if over:
            self._action = None
            return None
        seen = self._read(task.observe(state))
        if isinstance(task, GoalTask):
            seen = checks.with_goals(task, seen, state)
        self._action = self._read_action(self._act(seen))
        return self._limited(self._scene.commands(task.apply(self._action, state)))

    def _limited(self, commands: Mapping[str, Command]) -> dict[str, Command]:
        limited = {}
        for name, wanted in commands.items():
            command, exceeded = self._limits[name](wanted, self._held[name])
            if exceeded and name not in self._reported:
                self._reported.add(name)
                self._say(
                    f"{name} is commanded beyond the limits of {', '.join(exceeded)}: it is kept within"
                )
            limited[name] = self._held[name] = command
        return limited

    def stop(self, joints: Joints) -> dict[str, Command]:
        """Commands that stop all joints where they are."""
        self.go_on(joints)
        return dict(self._held)
