"""What is to be learned on the cart-pole: three tasks, the same for every backend and every learner."""

import math
from typing import ClassVar, NamedTuple

import gymnasium
import numpy as np

from robot_envs.task import Command, Task

ANGLE_LIMIT = 0.20943951023  # [rad], 12 degrees
POSITION_LIMIT = 0.4  # [m]
SET_POINT_STEP = 0.02  # [m] that one action moves the cart's set-point
MAX_STEPS = 3000
ALIVE_REWARD = 0.5
FALL_PENALTY = 10.0
_ANY = float(np.finfo(np.float32).max)


class CartPoleState(NamedTuple):
    """The robot's two joints; at a positive angle the pole leans towards -x (axis 0 -1 0)."""

    cart_position: float  # [m]
    cart_velocity: float  # [m/s]
    pole_angle: float  # [rad], 0 is upright
    pole_velocity: float  # [rad/s]


class CartPoleTask(Task[CartPoleState]):
    """One thing to learn on the cart-pole.

    Actions move the set-point of the cart's position controller. Set-points add up over an
    episode, starting from where the cart stands.

    Args:
        noise: half-width of what is drawn uniformly for the initial state; 0 starts every episode
            alike.
        max_steps: length at which an episode is cut off.

    Raises:
        ValueError: if noise or max_steps make no sense.
    """

    start = CartPoleState(0.0, 0.0, 0.0, 0.0)

    def __init__(self, noise: float, max_steps: int) -> None:
        if not 0.0 <= noise < ANGLE_LIMIT:
            raise ValueError(f"noise must lie in [0, {ANGLE_LIMIT}), not {noise}")
        super().__init__(noise, max_steps)

    def initial_command(self, state: CartPoleState) -> Command:
        """The cart's set-point [m]: where it stands."""
        return (state.cart_position,)


class BalanceTask(CartPoleTask):
    """Keep the pole up and the cart near the middle, by nudging the cart's set-point.

    Action 0 moves the set-point by -0.02 m, action 1 by +0.02 m. The reward of a step is
    0.5 + |pole angle| - |cart position|, and 10 less for the step that ends the episode by
    leaving +-0.4 m or +-12 degrees. The noise is of position [m] and angle [rad]; both joints
    start at rest.
    """

    def __init__(self, noise: float = 0.0, max_steps: int = MAX_STEPS) -> None:
        super().__init__(noise, max_steps)

    def action_space(self) -> gymnasium.spaces.Discrete:
        return gymnasium.spaces.Discrete(2)

    def observation_space(self) -> gymnasium.spaces.Box:
        """Float32, shape (4,): the state in its own order."""
        high = np.array([2 * POSITION_LIMIT, _ANY, np.pi, _ANY], dtype=np.float32)
        return gymnasium.spaces.Box(-high, high, dtype=np.float32)

    def initial_state(self, rng: np.random.Generator) -> CartPoleState:
        """Draws where an episode starts; both joints are at rest."""
        if self.noise == 0.0:
            return self.start
        position, angle = rng.uniform(-self.noise, self.noise, size=2)
        return CartPoleState(float(position), 0.0, float(angle), 0.0)

    def next_command(self, command: Command, action: int) -> Command:
        """Moves the cart's set-point [m] as the action (0 or 1) says."""
        if getattr(action, "shape", ()) == ():  # an array of several compares to neither
            if action == 1:
                return (command[0] + SET_POINT_STEP,)
            if action == 0:
                return (command[0] - SET_POINT_STEP,)
        raise ValueError(f"an action is 0 or 1, not {action!r}")

    def observation(self, state: CartPoleState) -> np.ndarray:
        """The state as the learner sees it: float32, shape (4,), in the state's order."""
        return np.array(state, dtype=np.float32)

    def is_terminal(self, state: CartPoleState) -> bool:
        """Whether the cart or the pole has left its range."""
        return abs(state.cart_position) > POSITION_LIMIT or abs(state.pole_angle) > ANGLE_LIMIT

    def reward(self, state: CartPoleState) -> float:
        """The reward for arriving in a state."""
        reward = ALIVE_REWARD + abs(state.pole_angle) - abs(state.cart_position)
        return reward - FALL_PENALTY if self.is_terminal(state) else reward


class ClassicTask(BalanceTask):
    """As Gymnasium's CartPole-v1: +1 for each step, up to 500 of them.

    Actions, observations and limits are BalanceTask's. Positions and velocities start within
    +-0.05 [m, m/s, rad, rad/s]. As in CartPole-v1 the step that falls counts as well.
    """

    def __init__(self, noise: float = 0.05, max_steps: int = 500) -> None:
        super().__init__(noise, max_steps)

    def initial_state(self, rng: np.random.Generator) -> CartPoleState:
        """Draws positions and velocities, all four from the same range."""
        return CartPoleTask.initial_state(self, rng)

    def reward(self, state: CartPoleState) -> float:
        """1, whatever the state."""
        return 1.0


class SwingUpTask(CartPoleTask):
    """Swing the hanging pole up and hold it there; only leaving the rail ends an episode early.

    The action, shape (1,) within -1 and 1, moves the set-point by up to 0.02 m either way. The
    reward of a step lies in [0, 1] and is the product of what dm_control's swing-up rewards:

        upright   (1 + cos angle) / 2
        centred   (1 + g(position / 0.4 m)) / 2
        slow      (1 + g(angular velocity / 5 rad/s)) / 2

    with the bell curve g(x) = 0.1 ** x², which is 0.1 at x = 1. There is no price on control.
    The pole hangs within +-`noise` at the start, velocities too. It would hang through the
    ground, so the stand is raised by 0.5 m.
    """

    height = 0.5
    start = CartPoleState(0.0, 0.0, math.pi, 0.0)
    fast: ClassVar[float] = 5.0  # [rad/s]

    def __init__(self, noise: float = 0.05, max_steps: int = 1250) -> None:
        super().__init__(noise, max_steps)

    def action_space(self) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def observation_space(self) -> gymnasium.spaces.Box:
        """Float32, shape (5,): cart position and velocity, sine, cosine, pole velocity."""
        high = np.array([2 * POSITION_LIMIT, _ANY, 1.0, 1.0, _ANY], dtype=np.float32)
        return gymnasium.spaces.Box(-high, high, dtype=np.float32)

    def next_command(self, command: Command, action: np.ndarray) -> Command:
        """Moves the cart's set-point [m] by `action[0]`, which lies in [-1, 1], times 0.02 m."""
        try:
            (share,) = action
            if -1.0 <= share <= 1.0:
                return (command[0] + SET_POINT_STEP * float(share),)
        except (TypeError, ValueError):  # not one number
            pass
        raise ValueError(f"an action is one number in [-1, 1], not {action!r}")

    def observation(self, state: CartPoleState) -> np.ndarray:
        """Float32, shape (5,); see `observation_space`."""
        position, velocity, angle, rate = state
        return np.array(
            (position, velocity, math.sin(angle), math.cos(angle), rate), dtype=np.float32
        )

    def is_terminal(self, state: CartPoleState) -> bool:
        """Whether the cart has left its range."""
        return abs(state.cart_position) > POSITION_LIMIT

    def reward(self, state: CartPoleState) -> float:
        """The reward for arriving in a state."""
        upright = (1.0 + math.cos(state.pole_angle)) / 2.0
        centred = (1.0 + _bell(state.cart_position / POSITION_LIMIT)) / 2.0
        slow = (1.0 + _bell(state.pole_velocity / self.fast)) / 2.0
        return upright * centred * slow


def _bell(x: float) -> float:
    """1 at 0, 0.1 at 1."""
    return 0.1 ** (x * x)


TASKS: dict[str, type[CartPoleTask]] = {
    "balance": BalanceTask,
    "classic": ClassicTask,
    "swing-up": SwingUpTask,
}
"""The tasks by name; each can be made without arguments."""
