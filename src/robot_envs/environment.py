"""The Gymnasium environment: it hands commands to a robot and lets the task judge the state."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec

from bullet_gazebo.pictures.camera import Camera
from robot_envs.backends.backend import RobotBackend
from robot_envs.picture import HEIGHT, WIDTH, RobotPicture
from robot_envs.robot import State
from robot_envs.sensing import Sensor
from robot_envs.task import Task
from robot_envs.variation import Randomisation
from web_page.display import hindrance

if TYPE_CHECKING:
    from viser import ViserServer

    from robot_envs.page import RobotOnPage

Shown_contra = TypeVar("Shown_contra", bound=tuple[float, ...], contravariant=True)


class Viewer(Protocol[Shown_contra]):
    """A window that shows the robot."""

    def show(self, state: Shown_contra) -> None:
        """Shows a state."""
        ...

    def close(self) -> None:
        """Closes the window; may be called twice."""
        ...


class RobotEnv(gymnasium.Env[np.ndarray, Any], Generic[State]):
    """A robot with a task, as Gymnasium knows environments.

    Two attributes tell a training what it may rely on:

    | attribute              | true where                                                          |
    |------------------------|---------------------------------------------------------------------|
    | `shares_robot`         | other environments of this process move the same robot, as over ROS: |
    |                        | use them one after the other, and begin with a reset                |
    | `spec.nondeterministic` | the same seed and actions give other bits each time, as in real time |

    Args:
        backend: moves the robot (see `robot_envs.backends`); the environment closes it.
        task: what is to be learned.
        sensor: how the state is measured; exactly and at once by default.
        randomisation: what differs from episode to episode; nothing by default.
        camera: where pictures are taken from, see `robot_envs.picture`.
        width: of the pictures [pixels].
        height: of the pictures [pixels].
        window: opens a window that shows a state every so many [s], for the render mode "human".
        render_mode: "rgb_array": pictures; "human": a window, where there is one; or none.
        control_period: of an action [s]; tells how fast pictures follow each other.

    Raises:
        RobotEnvError: for a window where there is no display.
        ValueError: for a render mode that doesn't exist, or pictures of no possible size.
    """

    def __init__(
        self,
        backend: RobotBackend[State],
        task: Task[State],
        *,
        control_period: float,
        sensor: Sensor[State] | None = None,
        randomisation: Randomisation | None = None,
        camera: Camera | None = None,
        width: int = WIDTH,
        height: int = HEIGHT,
        window: Callable[[float], Viewer[State]] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.backend = backend
        self._spec: EnvSpec | None = None
        self.task = task
        self.action_space = task.action_space()
        self.observation_space = task.observation_space()
        self.metadata = {
            "render_modes": ["human", "rgb_array"] if window and not hindrance() else ["rgb_array"],
            "render_fps": max(1, round(1.0 / control_period)),
        }
        known = ("human", "rgb_array") if window else ("rgb_array",)
        if render_mode is not None and render_mode not in known:
            names = " or ".join(f'"{name}"' for name in known)
            raise ValueError(f"render_mode is {names}, not {render_mode!r}")
        self.render_mode = render_mode
        self._sensor = sensor
        self._randomisation = randomisation
        self._picture = RobotPicture(
            backend.robot, width, height, camera=camera, raised=task.height, base=backend.base
        )
        self._window = window(control_period) if window and render_mode == "human" else None
        self._state = task.start
        self._command = task.initial_command(task.start)
        self._steps: int | None = None  # None: no episode is under way
        self._closed = False

    @property
    def shares_robot(self) -> bool:
        """Whether other environments of this process move the same robot."""
        return self.backend.shared

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
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: begins the stream of random numbers anew; None goes on with it.
            options: none are known; there is nothing that they would change.

        Raises:
            gymnasium.error.ClosedEnvironmentError: after `close()`.
            SimulatorError: if the backend doesn't answer.
        """
        self._check_open()
        super().reset(seed=seed)
        info = self._vary()
        self._state = state = self.backend.reset(self.task.initial_state(self.np_random))
        self._command = self.task.initial_command(state)
        self._steps = 0
        if self._sensor is not None:
            state = self._sensor.begin(state, self.np_random)
        if self._window is not None:
            self._window.show(self._state)
        return self.task.observation(state), info

    def _vary(self) -> dict[str, Any]:
        if self._randomisation is None:
            return {}
        variation, told = self._randomisation.draw(self.np_random)
        self.backend.vary(variation)
        return {"variation": told}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Carries out one action.

        Raises:
            gymnasium.error.ResetNeeded: if no episode is under way.
            gymnasium.error.ClosedEnvironmentError: after `close()`.
            ValueError: if the action isn't one of the task's.
            SimulatorError: if the backend doesn't answer.
        """
        if self._steps is None:
            self._check_open()
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        task = self.task
        self._command = task.next_command(self._command, action)
        self._state = state = self.backend.act(self._command)
        self._steps += 1
        terminated = task.is_terminal(state)
        truncated = not terminated and task.is_truncated(self._steps)
        if terminated or truncated:
            self._steps = None
        seen = state if self._sensor is None else self._sensor.measure(state, self.np_random)
        if self._window is not None:
            self._window.show(state)
        return task.observation(seen), task.reward(state), terminated, truncated, {}

    def render(self) -> np.ndarray | None:
        """A picture of the robot as it is, (height, width, 3). A window shows it by itself.

        Raises:
            RobotEnvError: if the robot's file can't be read.
            SimulatorError: if the backend has to be asked where the robot is, and doesn't answer.
        """
        return self._picture(self._state) if self.render_mode == "rgb_array" else None

    def draw_on(self, server: "ViserServer", beside: int = 0) -> "RobotOnPage[State]":
        """Draws the robot on a page of viser's: its visuals, a ground and lights, seen as in the pictures.

        Needs no render mode, with any backend:

            server = viser.ViserServer()
            robot = env.unwrapped.draw_on(server)
            ...  # env.reset(), env.step(action)
            robot()

        Args:
            server: the page's.
            beside: so many robots of this kind are on the page already; it is drawn beside them.

        Returns:
            What moves the robot on the page to where it is in that moment: a function, which takes a
            caption to show below the robot, or nothing, and may raise `SimulatorError`. Its two halves
            are `look()`, which tells where the robot is, and `show()`, which moves it there, then or later.

        Raises:
            RobotEnvError: if the robot's file can't be read.
            SimulatorError: if the backend has to be asked where the robot is, and doesn't answer.
        """
        return self._picture.draw_on(server, lambda: self._state, beside)

    def close(self) -> None:
        """Closes the backend and the window; may be called twice."""
        self._closed = True
        self._steps = None
        if self._window is not None:
            self._window.close()
        self._picture.close()
        self.backend.close()

    def _check_open(self) -> None:
        if self._closed:
            raise gymnasium.error.ClosedEnvironmentError(
                "this environment is closed; make another one"
            )
