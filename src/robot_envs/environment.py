"""The Gymnasium environment: commands to robots, and the task's evaluation of the state."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import gymnasium
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import data_equivalence

from robot_envs import checks
from robot_envs.backends import LOCKSTEP, OWN, REALTIME, make_backend
from robot_envs.backends.backend import RobotBackend, side_by_side
from robot_envs.pictures.drawn import HEIGHT, WIDTH
from robot_envs.restoring import SavedEnv
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.snapshot import EnvSnapshot
from robot_envs.task import GoalTask, Task, Unrewarded
from robot_envs.variation import Randomisation, Variation
from robot_envs.variation.imperfections import Actuator, Noise, Sensor
from robot_envs.variation.randomisation import UniformRandomisation
from robot_envs.world_state import Commands, InitialState, StateQuery, WorldState, both, part_of
from robot_sim.pictures.camera import CameraLike

MOST_SEED = 2**32  # of the sensors' noise


class _Step(NamedTuple):
    """A step that is under way."""

    number: int  # of the episode's steps, from 1
    action: Any  # checked
    arriving: Commands  # that reach the controllers
    sent: Commands | None  # that the state reports, where fewer arrive; None: the same


class RobotEnv(SavedEnv):
    """A robot with a task, as a Gymnasium environment.

    Two attributes tell a training what to expect:

    | attribute              | true if                                                             |
    |------------------------|---------------------------------------------------------------------|
    | `shares_robot`         | other environments of this process move the same robot, as over ROS: |
    |                        | use them one after the other, each beginning with a reset           |
    | `spec.nondeterministic` | the same seed and actions give other results each time, as in real time |

    If the robot is shared, copies made with `own_robot_options` have robots of their own;
    `side_by_side(count)` starts, and ends, their simulators at the same time.

    With a `GoalTask` it is a goal environment: observations are dicts, and it has `compute_reward`.
    `reset(options={...})` takes "initial_state", an `InitialState` in place of the task's, "snapshot", an
    `EnvSnapshot` where the episode begins instead, and for a `GoalTask` "goal".

    Args:
        robot: The robot, or several that share a world.
        task: What is to be learned.
        backend: "bullet" or "mujoco": in this process; "ros": over ROS in lock-step, bit-identical to
            "bullet"; "ros-own": the same in a simulator that is started for this environment alone, and
            replaced if it fails; "ros-realtime": over ROS, by Gazebo's own services; None: in this process,
            with the robot's engine. Or a backend, which the environment closes.
        control_period: Simulated time of an action [s]; None: the robot's. In real time 0 takes the
            newest joint state without waiting.
        deadline: Wall time that a simulator over ROS in lock-step may take for an answer, on top of 10 ms for
            each physics step [s]; None: 5 s, and 30 s for "ros-own", of which there may be many.
        renderer: What makes the pictures of cameras: "rays", with equal bits on all machines; "gl", by OpenGL
            on a GPU or in software; "auto": GL where there is a GPU, else rays. For "bullet", "mujoco" and
            "ros-own".
        max_steps: After how many steps an episode is truncated; None: the task's.
        sensor_noise: Standard deviation of noise on what joints and sensors measure; see `Sensor`.
        sensor_delay: Age of an observation [control steps].
        encoder_step: Resolution of position sensors [rad, m]; see `Sensor`.
        action_delay: How many control steps pass before a command arrives.
        actuator_limit: Limit of commands; see `Actuator`.
        actuator_lag: Time constant with which commands are followed [s]; see `Actuator`.
        randomisation: What differs from episode to episode: options of `UniformRandomisation` by name, or a
            `Randomisation`. The reset's `info["variation"]` reports what was drawn.
        camera: Of pictures, or only some fields of a `Camera`, as in {"yaw": 90.0}; None: one that sees the
            robots.
        width: Width of pictures [pixels].
        height: Height of pictures [pixels].
        render_mode: "rgb_array": pictures; "human": a page in the browser, whose address is printed once, at
            about the pace of real time; None: neither.

    Raises:
        RobotEnvError: If the robot's description is wrong, or it can't be brought up.
        ValueError: For an option that makes no sense.
    """

    side_by_side = staticmethod(side_by_side)
    _spec: EnvSpec | None = None

    def __init__(
        self,
        robot: Robot | Sequence[Robot],
        task: Task,
        backend: str | RobotBackend | None = None,
        *,
        control_period: float | None = None,
        deadline: float | None = None,
        renderer: str = "rays",
        max_steps: int | None = None,
        sensor_noise: Noise = 0.0,
        sensor_delay: int = 0,
        encoder_step: float | Mapping[str, float] = 0.0,
        action_delay: int = 0,
        actuator_limit: float | Mapping[str, float] | None = None,
        actuator_lag: float | Mapping[str, float] = 0.0,
        randomisation: Mapping[str, Any] | Randomisation | None = None,
        camera: CameraLike = None,
        width: int = WIDTH,
        height: int = HEIGHT,
        render_mode: str | None = None,
    ) -> None:
        self._closed = True  # until there is something to close
        checks.check_task(task)
        robots = list(robot) if isinstance(robot, Sequence) else [robot]
        if task.world is not None:
            robots[:1] = [replace(each, world=task.world) for each in robots[:1]]
        self.scene = scene = Scene(robots, task.objects)
        self.max_steps = checks.checked_steps(task.max_steps if max_steps is None else max_steps)
        self._set_task(task)
        self.control_period = period = checks.checked_period(scene.robots[0], control_period)
        nominal = period if period > 0.0 else scene.robots[0].control_period  # [s]
        names = task.query.sensors
        sensor = Sensor(scene.joints, nominal, sensor_noise, sensor_delay, encoder_step, names)
        self._sensor = None if sensor.is_exact else sensor
        holds = {name: port.holds for name, (_, port) in scene.ports.items()}
        actuator = Actuator(holds, nominal, action_delay, actuator_limit, actuator_lag)
        self._actuator = None if actuator.is_ideal else actuator
        if isinstance(randomisation, Mapping):
            randomisation = UniformRandomisation(scene, randomisation) if randomisation else None
        self._randomisation = randomisation
        self._prepare_drawing(nominal, camera, (width, height), render_mode)
        self._state: WorldState | None = None
        self._first: dict[str, Any] = {}  # commands that go along with an episode's first action
        self._initial = InitialState()
        self._variation = Variation()
        self._steps: int | None = None  # None: no episode is under way
        self._begun: _Step | None = None
        if backend is None or isinstance(backend, str):
            backend = make_backend(scene, backend, period, deadline, renderer)
        self.backend: RobotBackend = backend
        self._closed = False
        try:
            self._evaluator = self._register_queries(backend)
        except BaseException:
            self.close()
            raise

    def _register_queries(self, backend: RobotBackend) -> Task | Unrewarded:
        """Registers the task's queries; returns the evaluator of its states."""
        task = self.task
        if not self._hides or backend.complete:
            backend.look(both(task.query, task.reward_query))
            return task
        backend.look(task.query)
        text = "are 0, and nothing terminates: this world can't tell its reward_query"
        gymnasium.logger.warn(f"rewards of {type(task).__name__} {text}")
        return Unrewarded()

    def _set_task(self, task: Task) -> None:
        """Sets the task, its spaces, and the functions that check actions and observations."""
        self.task = task
        self._hides = task.reward_query != StateQuery()  # from `apply` and `observe`
        self._has_sensors = bool(task.query.sensors or task.reward_query.sensors)
        self.action_space = checks.made_space(task, "action_space")
        self.observation_space = space = checks.made_space(task, "observation_space")
        self._read_action = checks.action_reader(self.action_space)
        self._read = checks.observation_reader(space, type(task).__name__)
        self._goal_task = task if isinstance(task, GoalTask) else None
        if isinstance(task, GoalTask):
            self.observation_space = checks.goal_space(task, space)
            self.compute_reward = task.compute_reward  # environments without goals have none

    @property
    def shares_robot(self) -> bool:
        """Whether other environments of this process move the same robot."""
        return self.backend.shared

    @property
    def own_robot_options(self) -> dict[str, Any]:
        """Options that give a copy its own robot, bit-identical to this one, where this one is shared."""
        if self.backend.shared and self.backend.deterministic:
            return {"backend": OWN}
        return {}

    @property
    def same_robot_options(self) -> dict[str, list[str]]:
        """Values of options with which other environments move this robot, if it is shared."""
        return {"backend": [LOCKSTEP, REALTIME]} if self.backend.shared else {}

    @property
    def state(self) -> WorldState | None:
        """The true state, without sensor noise; None before the first reset."""
        return self._state

    @property
    def measures_exactly(self) -> bool:
        """Whether observations show the true state: no noise, no delay, no encoders."""
        return self._sensor is None

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made this; marks robots that don't repeat as nondeterministic."""
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
            seed: Restarts the stream of random numbers; None continues it.
            options: "initial_state", "snapshot", and for a `GoalTask` "goal"; see the class.

        Raises:
            gymnasium.error.ClosedEnvironmentError: After `close()`.
            ValueError: For an unknown option, or an impossible initial state or goal.
            SimulatorError: If the backend doesn't answer.
        """
        self._check_open()
        options = checks.reset_options(self.task, options or {})
        super().reset(seed=seed)
        self._steps = self._begun = None
        info: dict[str, Any] = {}
        if self._randomisation is not None:
            variation, info["variation"] = self._randomisation.draw(self.np_random)
            self._vary(variation)
        elif not self._variation.is_nominal:  # an episode before began at a snapshot
            self._vary(Variation())
        # Drawn even if it isn't used: streams stay the same.
        drawn = self.task.initial_state(self.np_random)
        start = options.get("snapshot", options.get("initial_state", drawn))
        if isinstance(start, EnvSnapshot):
            info.clear()  # it is varied as it was
        seed = int(self.np_random.integers(1, MOST_SEED)) if self._has_sensors else 0
        self._state = state = self._begin(start, seed)
        if self._actuator is not None:
            self._actuator.begin(state.commands)
        if self._goal_task is not None:
            shown, goal = self._shown(state), options.get("goal")
            checks.set_goal(self._goal_task, shown, self.np_random, goal)
        measured = state if self._sensor is None else self._sensor.begin(state, self.np_random)
        observation = self._observe(measured)
        self._steps = 0
        self._show()
        return observation, {**checks.checked(self.task, "info", self._evaluator.info(state), dict), **info}

    def _begin(self, start: InitialState | EnvSnapshot, seed: int) -> WorldState:
        if isinstance(start, EnvSnapshot):
            state = self._begin_at(start, seed)
        else:
            self._initial = start
            state = self.backend.reset(start, seed)
            self._first = self.scene.commands(start.commands)
        return state._replace(commands={**state.commands, **self._first}) if self._first else state

    def _shown(self, state: WorldState) -> WorldState:
        """Returns what `apply` and `observe` see of a state: no more than a deployed policy."""
        return part_of(state, self.task.query) if self._hides else state

    def _observe(self, measured: WorldState) -> Any:
        measured = self._shown(measured)
        seen = self._read(self.task.observe(measured))
        return seen if self._goal_task is None else checks.with_goals(self._goal_task, seen, measured)

    def begin_step(self, action: Any) -> None:
        """Sends a step's commands and returns at once, so that several simulators move at the same time.

        `step` with the same action takes the result; a reset or close drops it. Calling it is optional.
        Raises as `step`, and ValueError if a step is under way.
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
        commands = self.scene.commands(self.task.apply(action, self._shown(self._state)))
        if self._first:
            commands = {**self._first, **commands}
            self._first = {}
        if self._actuator is None:
            return _Step(self._steps + 1, action, commands, None)
        sent = {**self._state.commands, **commands}
        return _Step(self._steps + 1, action, self._actuator(sent), sent)

    def _taken(self, action: Any) -> _Step:
        """Returns the step begun with this action, or a new one."""
        begun = self._begun
        if begun is None:
            return self._prepared(action)
        action = self._read_action(action)
        if action is not begun.action and not data_equivalence(begun.action, action, exact=True):
            raise ValueError("step() was begun with another action")
        self._begun = None
        return begun

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Carries out one action.

        Raises:
            gymnasium.error.ResetNeeded: If no episode is under way.
            gymnasium.error.ClosedEnvironmentError: After `close()`.
            ValueError: If the action isn't in the action space, or isn't the one that was begun, or a method
                of the task returns something impossible.
            SimulatorError: If the backend doesn't answer.
        """
        task, evaluator = self.task, self._evaluator
        number, action, arriving, sent = self._taken(action)
        state = self.backend.act(arriving)
        if sent is not None:
            state = state._replace(commands=sent)
        self._state, self._steps = state, number
        ended = checks.checked(task, "is_terminal", evaluator.is_terminal(state), checks.FLAGS)
        terminated = bool(ended)
        is_over = self.max_steps is not None and number >= self.max_steps
        truncated = is_over and not terminated
        if terminated or truncated:
            self._steps = None
        measured = state if self._sensor is None else self._sensor.measure(state, self.np_random)
        self._show()
        reward = checks.checked_number(task, "reward", evaluator.reward(state, action))
        observation = self._observe(measured)
        info = checks.checked(task, "info", evaluator.info(state), dict)
        return observation, reward, terminated, truncated, info

    def sensor_reader(self, names: Sequence[str]) -> Callable[[], dict[str, Any]]:
        """Adds sensors, as "camera" or "camera@640x480", from the next reset on.

        Returns a function that returns what each has measured last, by "sensor.field"; it changes nothing of
        what the robot does. Raises SimulatorError if there is no such sensor.
        """
        self._check_open()
        query = both(self.task.query, self.task.reward_query)
        self.backend.look(both(query, StateQuery(sensors=tuple(names))))

        def read() -> dict[str, Any]:
            assert self._state is not None, "after a reset"
            readings = [(name, self._state.sensors[name].values) for name in names]
            return {f"{name}.{field}": each for name, all_ in readings for field, each in all_.items()}

        return read

    def __reduce__(self) -> Any:
        raise TypeError("an environment can't be copied or pickled; save_state() takes a snapshot")

    def close(self) -> None:
        """Closes the backend and the page; may be called twice."""
        self._closed = True
        self._steps = self._begun = None
        self._end_drawing()
        self.backend.close()
