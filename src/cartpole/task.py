"""The balancing task: observation, reward, end of an episode, initial state.

Knows neither ROS nor a simulator nor a learner; every environment runs this same task.
"""

from typing import NamedTuple

import numpy as np

ANGLE_LIMIT = 0.20943951023  # [rad], 12 degrees
POSITION_LIMIT = 0.4  # [m]
SET_POINT_STEP = 0.02  # [m] that one action moves the cart's set-point
MAX_STEPS = 3000
ALIVE_REWARD = 0.5
FALL_PENALTY = 10.0


class CartPoleState(NamedTuple):
    """The robot's two joints; at a positive angle the pole leans towards -x (axis 0 -1 0)."""

    cart_position: float  # [m]
    cart_velocity: float  # [m/s]
    pole_angle: float  # [rad], 0 is upright
    pole_velocity: float  # [rad/s]


class BalanceTask:
    """Keep the pole up and the cart near the middle, by nudging the cart's set-point.

    Action 0 moves the set-point by -0.02 m, action 1 by +0.02 m; set-points add up over an
    episode, starting from where the cart stands. The reward of a step is
    0.5 + |pole angle| - |cart position|, and 10 less for the step that ends the episode by
    leaving +-0.4 m or +-12 degrees.

    Args:
        noise: half-width of the uniform initial position [m] and angle [rad]; 0 starts every
            episode upright at the origin.
        max_steps: length at which an episode is cut off.
    """

    def __init__(self, noise: float = 0.0, max_steps: int = MAX_STEPS) -> None:
        if not 0.0 <= noise < ANGLE_LIMIT:
            raise ValueError(f"noise must lie in [0, {ANGLE_LIMIT}), not {noise}")
        if max_steps < 1:
            raise ValueError(f"max_steps must be at least 1, not {max_steps}")
        self.noise = noise
        self.max_steps = max_steps

    def initial_state(self, rng: np.random.Generator) -> CartPoleState:
        """Draws where an episode starts; both joints are at rest."""
        if self.noise == 0.0:
            return CartPoleState(0.0, 0.0, 0.0, 0.0)
        position, angle = rng.uniform(-self.noise, self.noise, size=2)
        return CartPoleState(float(position), 0.0, float(angle), 0.0)

    def next_set_point(self, set_point: float, action: int) -> float:
        """Moves the cart's set-point [m] as the action (0 or 1) says."""
        return set_point + (SET_POINT_STEP if action == 1 else -SET_POINT_STEP)

    def observation(self, state: CartPoleState) -> np.ndarray:
        """The state as the learner sees it: float32, shape (4,), in the state's order."""
        return np.array(state, dtype=np.float32)

    def is_terminal(self, state: CartPoleState) -> bool:
        """Whether the cart or the pole has left its range."""
        return abs(state.cart_position) > POSITION_LIMIT or abs(state.pole_angle) > ANGLE_LIMIT

    def is_truncated(self, steps: int) -> bool:
        """Whether an episode of that many steps is cut off."""
        return steps >= self.max_steps

    def reward(self, state: CartPoleState) -> float:
        """The reward for arriving in a state."""
        reward = ALIVE_REWARD + abs(state.pole_angle) - abs(state.cart_position)
        return reward - FALL_PENALTY if self.is_terminal(state) else reward
