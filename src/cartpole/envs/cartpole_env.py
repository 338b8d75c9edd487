"""The Gymnasium environment: it hands actions to a plant and lets the task judge the state."""

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec

from cartpole.envs.display import hindrance
from cartpole.envs.drawing import draw
from cartpole.envs.plant import CONTROL_PERIOD, Plant
from cartpole.envs.sensor import Sensor
from cartpole.envs.variation import Randomisation
from cartpole.task import BalanceTask, Task

if TYPE_CHECKING:
    from cartpole.envs.window import Window


class CartPoleEnv(gymnasium.Env[np.ndarray, Any]):
    """The cart-pole robot, whose cart has a position controller that follows a set-point.

    | id                    | task          | episode ends beyond        | cut off after |
    |-----------------------|---------------|----------------------------|---------------|
    | `cartpole/Balance-v0` | `BalanceTask` | +-0.4 m, +-0.20943951 rad  | 3000 steps    |
    | `cartpole/Classic-v0` | `ClassicTask` | +-0.4 m, +-0.20943951 rad  | 500 steps     |
    | `cartpole/SwingUp-v0` | `SwingUpTask` | +-0.4 m                    | 1250 steps    |

    ## Action space
    Set-points add up over an episode, starting where the cart stands.

    | task              | space              | meaning                                      |
    |-------------------|--------------------|----------------------------------------------|
    | balance, classic  | `Discrete(2)`      | 0: set-point -0.02 m, 1: set-point +0.02 m   |
    | swing-up          | `Box(-1, 1, (1,))` | set-point + 0.02 m times the action          |

    ## Observation space
    `Box`, float32.

    | balance, classic | swing-up | quantity                                      | unit  |
    |------------------|----------|-----------------------------------------------|-------|
    | 0                | 0        | cart position                                 | m     |
    | 1                | 1        | cart velocity                                 | m/s   |
    | 2                |          | pole angle, 0 upright, positive towards -x    | rad   |
    |                  | 2, 3     | sine and cosine of the pole angle             |       |
    | 3                | 4        | pole angular velocity                         | rad/s |

    ## Rewards
    | task     | for each step                                                             |
    |----------|---------------------------------------------------------------------------|
    | balance  | 0.5 + abs(pole angle) - abs(cart position); 10 less when it ends         |
    | classic  | 1                                                                         |
    | swing-up | upright x centred x slow, within 0 and 1: `cartpole.task.SwingUpTask`     |

    ## Starting state
    | task     | start            | `noise`, uniform, either way                              |
    |----------|------------------|-----------------------------------------------------------|
    | balance  | upright, at rest | 0 by default; of position [m] and angle [rad]             |
    | classic  | upright          | 0.05 by default; of both positions and both velocities    |
    | swing-up | hanging          | 0.05 by default; of both positions and both velocities    |

    ## Arguments of `gymnasium.make`
    | name             | default    | meaning                                                  |
    |------------------|------------|----------------------------------------------------------|
    | `backend`        | `"bullet"` | the robot: in this process, ...                          |
    |                  | `"ros"`    | ... over ROS in lock-step, with the same bits, ...       |
    |                  | `"ros-realtime"` | ... or over ROS in real time, by Gazebo's own services alone |
    | `engine`         | `"bullet"` | physics in this process: PyBullet, or `"mujoco"` (`./ws extras`); |
    |                  |            | over ROS it is the simulator's (`physics:=`)              |
    | `control_period` | 0.008      | simulated time of an action [s], whole physics steps     |
    | `noise`          | the task's | of the starting state                                    |
    | `max_steps`      | the task's | length at which an episode is cut off                    |
    | `sensor_noise`   | 0          | standard deviation; one or four numbers, in the state's units |
    | `sensor_delay`   | 0          | age of an observation [control steps]                    |
    | `randomisation`  | none       | a dict of `mass`, `length`, `cart_friction`, `pole_friction`, see |
    |                  |            | `cartpole.envs.variation.Randomisation`; each episode gets its own |
    |                  |            | robot, which stands in the reset's `info["variation"]`   |
    | `render_mode`    | none       | `"rgb_array"`: pictures, (320, 640, 3) of uint8; `"human"`: a window |

    Args:
        plant: the robot (see `cartpole.envs.plant.Plant`); the environment closes it.
        task: what is to be learned; `BalanceTask()` by default.
        sensor: how the state is measured; exactly and at once by default.
        randomisation: what differs from episode to episode; nothing by default.
        render_mode: see above.
        control_period: the plant's [s]; tells how fast pictures follow each other.

    Raises:
        CartpoleError: for a window where there is no display.
        ValueError: for a render mode that doesn't exist.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 125}

    def __init__(
        self,
        plant: Plant,
        task: Task | None = None,
        *,
        sensor: Sensor | None = None,
        randomisation: Randomisation | None = None,
        render_mode: str | None = None,
        control_period: float = CONTROL_PERIOD,
    ) -> None:
        self.plant = plant
        self._spec: EnvSpec | None = None
        self.task = task or BalanceTask()
        self.action_space = self.task.action_space()
        self.observation_space = self.task.observation_space()
        self.metadata = _metadata(control_period)
        self.render_mode = render_mode
        self._sensor = sensor
        self._randomisation = randomisation
        self._window = _window(render_mode, control_period)
        self._state = self.task.start
        self._set_point = 0.0
        self._steps: int | None = None  # None: no episode is under way
        self._closed = False

    @property
    def shares_robot(self) -> bool:
        """Whether other environments of this process move the same robot, as over ROS."""
        return self.plant.shared

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made this; says so where the robot never repeats itself."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None and not self.plant.deterministic:
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
            SimulatorError: if the plant doesn't answer.
        """
        self._check_open()
        super().reset(seed=seed)
        info = self._vary()
        self._state = state = self.plant.reset(self.task.initial_state(self.np_random))
        self._set_point = state.cart_position
        self._steps = 0
        if self._sensor is not None:
            state = self._sensor.begin(state, self.np_random)
        if self._window is not None:
            self._window.show(self._state)
        return self.task.observation(state), info

    def _vary(self) -> dict[str, Any]:
        if self._randomisation is None:
            return {}
        variation = self._randomisation.draw(self.np_random)
        self.plant.vary(variation)
        return {"variation": np.array(variation)}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Carries out one action.

        Raises:
            gymnasium.error.ResetNeeded: if no episode is under way.
            gymnasium.error.ClosedEnvironmentError: after `close()`.
            ValueError: if the action isn't one of the task's.
            SimulatorError: if the plant doesn't answer.
        """
        if self._steps is None:
            self._check_open()
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        task = self.task
        self._set_point = task.next_set_point(self._set_point, action)
        self._state = state = self.plant.act(self._set_point)
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
        """The robot as it is: (320, 640, 3) of uint8. A window shows it at every step by itself."""
        return draw(self._state) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the plant and the window; may be called twice."""
        self._closed = True
        self._steps = None
        if self._window is not None:
            self._window.close()
        self.plant.close()

    def _check_open(self) -> None:
        if self._closed:
            raise gymnasium.error.ClosedEnvironmentError(
                "this environment is closed; make another one"
            )


def _metadata(control_period: float) -> dict[str, Any]:
    """Gymnasium's checker tries all modes that are listed, so only those that this machine has."""
    modes = ["human", "rgb_array"] if not hindrance() else ["rgb_array"]
    return {"render_modes": modes, "render_fps": max(1, round(1.0 / control_period))}


def _window(render_mode: str | None, period: float) -> "Window | None":
    if render_mode not in (None, "rgb_array", "human"):
        raise ValueError(f'render_mode is "human" or "rgb_array", not {render_mode!r}')
    if render_mode != "human":
        return None
    from cartpole.envs.window import Window  # loads PyBullet, which nothing over ROS needs

    return Window(period)
