"""The Gymnasium environment: it hands commands to robots and lets the task judge the state."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import gymnasium
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import data_equivalence

from bullet_gazebo.pictures.camera import Camera
from bullet_gazebo.state import did_you_mean
from robot_envs.backends.backend import RobotBackend
from robot_envs.backends.choice import OWN, make_backend
from robot_envs.backends.side_by_side import side_by_side
from robot_envs.checks import task_checks
from robot_envs.checks.goals import aim, goal_space, with_goals
from robot_envs.checks.spaces import action_reader, observation_reader
from robot_envs.checks.task_checks import check_steps, check_task
from robot_envs.pictures.drawn import DrawnEnv, Viewer
from robot_envs.pictures.picture import HEIGHT, WIDTH
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.task import GoalTask, Task
from robot_envs.variation import Randomisation
from robot_envs.variation.actuation import Actuator
from robot_envs.variation.randomisation import UniformRandomisation
from robot_envs.variation.sensing import Noise, Sensor
from robot_envs.world_state import Commands, InitialState, WorldState

RESET_OPTIONS = ("initial_state", "goal")


class _Step(NamedTuple):
    """A step that is under way.

    Args:
        number: of the episode's steps, from 1.
        action: as it was read.
        arriving: the commands that controllers get.
        sent: those that the state is to tell, whatever arrived of them; None: the same.
    """

    number: int
    action: Any
    arriving: Commands
    sent: Commands | None


class RobotEnv(DrawnEnv):
    """A robot with a task, as Gymnasium knows environments.

    Two attributes tell a training what it may rely on:

    | attribute              | true where                                                          |
    |------------------------|---------------------------------------------------------------------|
    | `shares_robot`         | other environments of this process move the same robot, as over ROS: |
    |                        | use them one after the other, and begin with a reset                |
    | `spec.nondeterministic` | the same seed and actions give other bits each time, as in real time |

    Where the robot is shared, copies that are made with `own_robot_options` have their own; with
    `side_by_side(count)` their simulators start, and end, at the same time.

    With a `GoalTask` it is a goal environment: observations are dicts, and it has `compute_reward`.
    `reset(options={...})` knows "initial_state", an `InitialState` in place of the task's, and for a
    `GoalTask` "goal".

    Args:
        robot: the robot, or several that share a world.
        task: what is to be learned.
        backend: "bullet" or "mujoco": in this process; "ros": over ROS in lock-step, with the bits of
            "bullet"; "ros-own": the same in a simulator that is started for this environment alone, and
            replaced if it fails; "ros-realtime": over ROS, by Gazebo's own services; None: in this process,
            with the robot's engine. Or one that is made already; the environment closes it.
        control_period: simulated time of an action [s]; None: the robot's. In real time 0 takes the
            newest joint state, without waiting for another one.
        deadline: wall time [s] that a simulator over ROS in lock-step may take for an answer, beside 10 ms
            for each physics step; None: 5 s, and 30 s for "ros-own", of which there may be many.
        max_steps: after how many steps an episode is cut off; None: the task's.
        sensor_noise: standard deviation of noise on joints' positions and velocities; see `Sensor`.
        sensor_delay: how many control steps old an observation is.
        encoder_step: what positions are rounded to [rad, m]; see `Sensor`, too.
        action_delay: how many control steps pass before a command arrives.
        actuator_limit: of commands; see `Actuator`.
        actuator_lag: time constant of what follows commands [s]; see `Actuator`.
        randomisation: what differs from episode to episode: options of `UniformRandomisation` by name, or a
            `Randomisation` of one's own. What was drawn stands in the reset's `info["variation"]`.
        camera: where pictures are taken from, a `robot_envs.Camera`; None: so that the robots are seen.
        width: of the pictures [pixels].
        height: of the pictures [pixels].
        window: opens a window that shows joints every so many [s], for the render mode "human".
        render_mode: "rgb_array": pictures; "human": a window, where there is one; or none.

    Raises:
        RobotEnvError: if the robot's description is wrong, or it can't be brought up; for a window where
            there is no display.
        ValueError: for an option that makes no sense.
    """

    side_by_side = staticmethod(side_by_side)

    def __init__(
        self,
        robot: Robot | Sequence[Robot],
        task: Task,
        backend: str | RobotBackend | None = None,
        *,
        control_period: float | None = None,
        deadline: float | None = None,
        max_steps: int | None = None,
        sensor_noise: Noise = 0.0,
        sensor_delay: int = 0,
        encoder_step: float | Mapping[str, float] = 0.0,
        action_delay: int = 0,
        actuator_limit: float | Mapping[str, float] | None = None,
        actuator_lag: float | Mapping[str, float] = 0.0,
        randomisation: Mapping[str, Any] | Randomisation | None = None,
        camera: Camera | None = None,
        width: int = WIDTH,
        height: int = HEIGHT,
        window: Callable[[float], Viewer] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self._closed = True  # until there is something to close
        check_task(task)
        self.scene = Scene(robot if isinstance(robot, Sequence) else [robot], task.objects)
        self.task = task
        self.max_steps = task.max_steps if max_steps is None else max_steps
        check_steps(self.max_steps)
        self.action_space = task_checks.space(task, "action_space")
        self._read_action = action_reader(self.action_space)
        space = task_checks.space(task, "observation_space")
        self._read = observation_reader(space, type(task).__name__)
        self.observation_space = space
        self._aimed = task if isinstance(task, GoalTask) else None
        if isinstance(task, GoalTask):
            self.observation_space = goal_space(task, space)
            self.compute_reward = task.compute_reward  # environments without goals have none
        period = self.scene.robots[0].control_period if control_period is None else control_period
        if not isinstance(period, (int, float)):
            raise ValueError(f"control_period is a number [s], not {period!r}")
        self.control_period = period
        shown = period if period > 0.0 else self.scene.robots[0].control_period  # [s] a picture
        sensor = Sensor(self.scene.joints, shown, sensor_noise, sensor_delay, encoder_step)
        self._sensor = None if sensor.is_exact else sensor
        holds = {name: port.holds for name, (_, port) in self.scene.ports.items()}
        actuator = Actuator(holds, shown, action_delay, actuator_limit, actuator_lag)
        self._actuator = None if actuator.is_ideal else actuator
        if isinstance(randomisation, Mapping):
            randomisation = (
                UniformRandomisation(self.scene, randomisation) if randomisation else None
            )
        self._randomisation = randomisation
        self._draw(shown, camera, (width, height), window, render_mode)
        self._spec: EnvSpec | None = None
        self._state: WorldState | None = None
        self._commands = self.scene.commands
        self._first: dict[str, Any] = {}  # to be commanded with an episode's first action
        self._initial = InitialState()
        self._steps: int | None = None  # None: no episode is under way
        self._begun: _Step | None = None
        made = backend is None or isinstance(backend, str)
        self.backend: RobotBackend = (
            make_backend(self.scene, backend, period, deadline) if made else backend  # type: ignore[assignment,arg-type]
        )
        self._closed = False
        try:
            self.backend.look(task.query)
        except BaseException:
            self.close()
            raise

    @property
    def shares_robot(self) -> bool:
        """Whether other environments of this process move the same robot."""
        return self.backend.shared

    @property
    def own_robot_options(self) -> dict[str, Any]:
        """Options by which a copy gets a robot of its own, the same to the bit, where this one shares it."""
        if self.backend.shared and self.backend.deterministic:
            return {"backend": OWN}
        return {}

    @property
    def state(self) -> WorldState | None:
        """The world as it is, whatever sensors make of it; None before the first reset."""
        return self._state

    @property
    def measures_exactly(self) -> bool:
        """Whether observations are made of the state as it is: no noise, no delay, no encoders."""
        return self._sensor is None

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made this; says so where the robot never repeats itself."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None and not self.backend.deterministic:
            spec.nondeterministic = True
        self._spec = spec

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: begins the stream of random numbers anew; None goes on with it.
            options: "initial_state", and for a `GoalTask` "goal"; see the class.

        Raises:
            gymnasium.error.ClosedEnvironmentError: after `close()`.
            ValueError: for an option that isn't known, or an initial state or goal that can't be.
            SimulatorError: if the backend doesn't answer.
        """
        self._check_open()
        options = self._known_options(options or {})
        super().reset(seed=seed)
        self._steps = self._begun = None
        info = self._vary()
        drawn = self.task.initial_state(self.np_random)
        self._initial = initial = options.get("initial_state", drawn)
        state = self.backend.reset(initial)
        self._first = self._commands(initial.commands)
        if self._first:
            state = state._replace(commands={**state.commands, **self._first})
        self._state = state
        if self._actuator is not None:
            self._actuator.begin(state.commands)
        if self._aimed is not None:
            aim(self._aimed, state, self.np_random, options.get("goal"))
        measured = state if self._sensor is None else self._sensor.begin(state, self.np_random)
        seen = self._read(self.task.observe(measured))
        self._steps = 0
        self._show()
        if self._aimed is not None:
            seen = with_goals(self._aimed, seen, measured)
        return seen, {**task_checks.told(self.task, self.task.info(state)), **info}

    def _known_options(self, options: dict[str, Any]) -> dict[str, Any]:
        for name in options:
            if name not in RESET_OPTIONS:
                raise ValueError(
                    f"reset knows no option '{name}'{did_you_mean(name, RESET_OPTIONS)}"
                )
        if "goal" in options and not isinstance(self.task, GoalTask):
            raise ValueError(f"{type(self.task).__name__} has no goal; only a GoalTask does")
        if not isinstance(options.get("initial_state", self._initial), InitialState):
            raise ValueError(f"initial_state is an InitialState, not {options['initial_state']!r}")
        return options

    def _vary(self) -> dict[str, Any]:
        if self._randomisation is None:
            return {}
        variation, told = self._randomisation.draw(self.np_random)
        self.backend.vary(variation)
        return {"variation": told}

    def begin_step(self, action: Any) -> None:
        """Sends a step's commands and returns at once, so that several simulators move at the same time.

        `step` with the same action takes the result; a reset or close drops it. Nobody has to call this.

        Raises:
            Exception: as `step`; and a ValueError if a step is under way.
        """
        if self._begun is not None:
            raise ValueError("begin_step() was called twice; step() with its action comes next")
        begun = self._prepared(action)
        self.backend.begin(begun.arriving)
        self._begun = begun

    def _prepared(self, action: Any) -> _Step:
        if self._steps is None or self._state is None:
            self._check_open()
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        action = self._read_action(action)
        commands = self._commands(self.task.apply(action, self._state))
        if self._first:  # what the controllers held until now goes along
            commands = {**self._first, **commands}
            self._first = {}
        if self._actuator is None:
            return _Step(self._steps + 1, action, commands, None)
        sent = {**self._state.commands, **commands}
        return _Step(self._steps + 1, action, self._actuator(sent), sent)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Carries out one action.

        Raises:
            gymnasium.error.ResetNeeded: if no episode is under way.
            gymnasium.error.ClosedEnvironmentError: after `close()`.
            ValueError: if the action isn't one of the task's, or isn't the one that was begun, or the task
                commands or returns what it can't.
            SimulatorError: if the backend doesn't answer.
        """
        begun, task = self._begun, self.task
        if begun is None:
            begun = self._prepared(action)
        else:
            action = self._read_action(action)
            if action is not begun.action and not data_equivalence(
                begun.action, action, exact=True
            ):
                raise ValueError("step() was begun with another action")
        self._begun = None
        action = begun.action
        state = self.backend.act(begun.arriving)
        if begun.sent is not None:
            state = state._replace(commands=begun.sent)
        self._state = state
        self._steps = begun.number
        terminated: Any = task.is_terminal(state)
        if type(terminated) is not bool:
            terminated = task_checks.flag(task, "is_terminal", terminated)
        truncated = not terminated and self._steps == self.max_steps
        if terminated or truncated:
            self._steps = None
        measured = state if self._sensor is None else self._sensor.measure(state, self.np_random)
        self._show()
        reward: Any = task.reward(state, action)
        if type(reward) is not float or not math.isfinite(reward):
            reward = task_checks.number(task, "reward", reward)
        seen = self._read(task.observe(measured))
        if self._aimed is not None:
            seen = with_goals(self._aimed, seen, measured)
        info: Any = task.info(state)
        if type(info) is not dict:
            info = task_checks.told(task, info)
        return seen, reward, terminated, truncated, info

    def close(self) -> None:
        """Closes the backend and the window; may be called twice."""
        self._closed = True
        self._steps = self._begun = None
        self._end_drawing()
        self.backend.close()

    def _check_open(self) -> None:
        if self._closed:
            raise gymnasium.error.ClosedEnvironmentError(
                "this environment is closed; make another one"
            )
