"""The Gymnasium environment: it hands actions to a plant and lets the task judge the state."""

from typing import Any

import gymnasium
import numpy as np

from cartpole.envs.plant import Plant
from cartpole.task import POSITION_LIMIT, BalanceTask

_ANY = float(np.finfo(np.float32).max)
_HIGH = np.array([2 * POSITION_LIMIT, _ANY, np.pi, _ANY], dtype=np.float32)


class CartPoleEnv(gymnasium.Env[np.ndarray, np.int64]):
    """Balance a pole on a cart whose position controller follows a set-point.

    ## Action space
    `Discrete(2)`; set-points add up over an episode, starting where the cart stands.

    | action | meaning                             |
    |--------|-------------------------------------|
    | 0      | move the cart's set-point by -0.02 m |
    | 1      | move the cart's set-point by +0.02 m |

    ## Observation space
    `Box(4,)`, float32.

    | index | quantity              | unit  | episode ends beyond |
    |-------|-----------------------|-------|---------------------|
    | 0     | cart position         | m     | +-0.4               |
    | 1     | cart velocity         | m/s   |                     |
    | 2     | pole angle, 0 upright | rad   | +-0.20943951023     |
    | 3     | pole angular velocity | rad/s |                     |

    ## Rewards
    0.5 + |pole angle| - |cart position| for each step; 10 less for the step that falls.

    ## Starting state
    All zeros, or uniform within the task's `noise` for position and angle.

    ## Episode end
    Terminated when the cart or the pole leaves its range, truncated after the task's
    `max_steps` (3000).

    ## Arguments
    `plant`: the robot (see `cartpole.envs.plant.Plant`); the environment closes it.
    `task`: the `BalanceTask` that gives everything above.
    """

    metadata = {"render_modes": []}

    def __init__(self, plant: Plant, task: BalanceTask | None = None) -> None:
        self.plant = plant
        self.task = task or BalanceTask()
        self.action_space = gymnasium.spaces.Discrete(2)
        self.observation_space = gymnasium.spaces.Box(-_HIGH, _HIGH, dtype=np.float32)
        self._set_point = 0.0
        self._steps: int | None = None  # None: no episode is under way

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode.

        Raises:
            SimulatorError: if the plant doesn't answer.
        """
        super().reset(seed=seed)
        state = self.plant.reset(self.task.initial_state(self.np_random))
        self._set_point = state.cart_position
        self._steps = 0
        return self.task.observation(state), {}

    def step(self, action: np.int64 | int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Carries out one action.

        Raises:
            gymnasium.error.ResetNeeded: if no episode is under way.
            SimulatorError: if the plant doesn't answer.
        """
        if self._steps is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        task = self.task
        self._set_point = task.next_set_point(self._set_point, int(action))
        state = self.plant.act(self._set_point)
        self._steps += 1
        terminated = task.is_terminal(state)
        truncated = not terminated and task.is_truncated(self._steps)
        if terminated or truncated:
            self._steps = None
        return task.observation(state), task.reward(state), terminated, truncated, {}

    def close(self) -> None:
        """Closes the plant."""
        self.plant.close()
