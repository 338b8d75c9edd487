"""The cart-pole's three tasks, the same for every backend and every learner."""

import math
from typing import ClassVar, NamedTuple, Self

import gymnasium
import numpy as np

from cartpole.robot import CART_JOINT, CONTROLLER, MODEL, POLE_JOINT
from robot_envs.task import Task
from robot_envs.world_state import Commands, InitialState, Pose, WorldState

ANGLE_LIMIT = 0.20943951023  # [rad], 12 degrees
POSITION_LIMIT = 0.4  # [m]
SET_POINT_STEP = 0.02  # [m] that one action moves the cart's set-point
ALIVE_REWARD = 0.5
FALL_PENALTY = 10.0
_ANY = float(np.finfo(np.float32).max)


class CartPoleState(NamedTuple):
    """The robot's two joints; at a positive angle the pole leans towards -x (axis 0 -1 0)."""

    cart_position: float  # [m]
    cart_velocity: float  # [m/s]
    pole_angle: float  # [rad], 0 is upright
    pole_velocity: float  # [rad/s]

    @classmethod
    def of(cls, state: WorldState) -> Self:
        """Returns the cart-pole's joints in a world's state."""
        cart, pole = state.joints[CART_JOINT], state.joints[POLE_JOINT]
        return cls(cart.position, cart.velocity, pole.position, pole.velocity)

    def to_begin(self, height: float = 0.0) -> InitialState:
        """Returns an episode's initial state, with the stand raised by a height [m]."""
        joints = {CART_JOINT: (self[0], self[1]), POLE_JOINT: (self[2], self[3])}
        raised = {MODEL: Pose((0.0, 0.0, height))} if height else {}
        return InitialState(joints, raised)


class CartPoleTask(Task):
    """Base class of the cart-pole's tasks: actions move the set-point of the cart's position controller.

    Set-points add up over an episode, starting where the cart stands. `noise` is the half-width of the
    uniform noise on the initial state; with 0 all episodes start alike.
    """

    start: ClassVar[CartPoleState] = CartPoleState(0.0, 0.0, 0.0, 0.0)  # without noise
    height: ClassVar[float] = 0.0  # [m] above the ground, for the pole to clear it

    def __init__(self, noise: float) -> None:
        if not 0.0 <= noise < ANGLE_LIMIT:
            raise ValueError(f"noise must lie in [0, {ANGLE_LIMIT}), not {noise}")
        self.noise = noise

    def draw(self, rng: np.random.Generator) -> CartPoleState:
        """Draws the initial state: positions and velocities within `noise` of `start`."""
        offsets = rng.uniform(-self.noise, self.noise, size=len(self.start))
        pairs = zip(self.start, offsets, strict=True)
        return CartPoleState(*(float(value + offset) for value, offset in pairs))

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        return self.draw(rng).to_begin(self.height)


class BalanceTask(CartPoleTask):
    """Keep the pole up and the cart near the middle, by nudging the cart's set-point; see `CartPoleEnv`.

    The noise is of position [m] and angle [rad]; both joints start at rest.
    """

    max_steps = 3000

    def __init__(self, noise: float = 0.0) -> None:
        super().__init__(noise)

    def action_space(self) -> gymnasium.spaces.Discrete:
        return gymnasium.spaces.Discrete(2)

    def observation_space(self) -> gymnasium.spaces.Box:
        """Float32, shape (4,): the fields of `CartPoleState` in order."""
        high = np.array([2 * POSITION_LIMIT, _ANY, np.pi, _ANY], dtype=np.float32)
        return gymnasium.spaces.Box(-high, high, dtype=np.float32)

    def draw(self, rng: np.random.Generator) -> CartPoleState:
        """Draws the initial state; both joints are at rest."""
        if self.noise == 0.0:
            return self.start
        position, angle = rng.uniform(-self.noise, self.noise, size=2)
        return CartPoleState(float(position), 0.0, float(angle), 0.0)

    def apply(self, action: int, state: WorldState) -> Commands:
        step = SET_POINT_STEP if action == 1 else -SET_POINT_STEP
        return {CONTROLLER: state.commands[CONTROLLER] + step}

    def observe(self, state: WorldState) -> np.ndarray:
        cart, pole = state.joints[CART_JOINT], state.joints[POLE_JOINT]
        return np.array((*cart[:2], *pole[:2]), dtype=np.float32)

    def is_terminal(self, state: WorldState) -> bool:
        cart, pole = state.joints[CART_JOINT], state.joints[POLE_JOINT]
        return abs(cart.position) > POSITION_LIMIT or abs(pole.position) > ANGLE_LIMIT

    def reward(self, state: WorldState, action: int) -> float:
        cart, pole = state.joints[CART_JOINT], state.joints[POLE_JOINT]
        reward = ALIVE_REWARD + abs(pole.position) - abs(cart.position)
        return reward - FALL_PENALTY if self.is_terminal(state) else reward


class ClassicTask(BalanceTask):
    """As Gymnasium's CartPole-v1; see `CartPoleEnv`. As there, the step that falls counts as well."""

    max_steps = 500

    def __init__(self, noise: float = 0.05) -> None:
        super().__init__(noise)

    def draw(self, rng: np.random.Generator) -> CartPoleState:
        return CartPoleTask.draw(self, rng)

    def reward(self, state: WorldState, action: int) -> float:
        return 1.0


class SwingUpTask(CartPoleTask):
    """Swing the hanging pole up and hold it there; only leaving the rail ends an episode early.

    The action, shape (1,) within -1 and 1, moves the set-point by up to 0.02 m either way. The
    reward of a step lies in [0, 1] and is the product of what dm_control's swing-up rewards:

        upright   (1 + cos angle) / 2
        centred   (1 + g(position / 0.4 m)) / 2
        slow      (1 + g(angular velocity / 5 rad/s)) / 2

    with the bell curve g(x) = 0.1 ** x², which is 0.1 at x = 1. Control is free.
    The pole hangs within +-`noise` at the start, velocities too. It would hang through the
    ground, so the stand is raised by 0.5 m.
    """

    max_steps = 1250
    height = 0.5
    start = CartPoleState(0.0, 0.0, math.pi, 0.0)
    fast: ClassVar[float] = 5.0  # [rad/s]

    def __init__(self, noise: float = 0.05) -> None:
        super().__init__(noise)

    def action_space(self) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)

    def observation_space(self) -> gymnasium.spaces.Box:
        """Float32, shape (5,): cart position and velocity, sine, cosine, pole velocity."""
        high = np.array([2 * POSITION_LIMIT, _ANY, 1.0, 1.0, _ANY], dtype=np.float32)
        return gymnasium.spaces.Box(-high, high, dtype=np.float32)

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        step = SET_POINT_STEP * float(action[0])
        return {CONTROLLER: state.commands[CONTROLLER] + step}

    def observe(self, state: WorldState) -> np.ndarray:
        seen = CartPoleState.of(state)
        turned = (math.sin(seen.pole_angle), math.cos(seen.pole_angle), seen.pole_velocity)
        return np.array((seen.cart_position, seen.cart_velocity, *turned), dtype=np.float32)

    def is_terminal(self, state: WorldState) -> bool:
        return abs(state.joints[CART_JOINT].position) > POSITION_LIMIT

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        cart, pole = state.joints[CART_JOINT], state.joints[POLE_JOINT]
        upright = (1.0 + math.cos(pole.position)) / 2.0
        centred = (1.0 + _bell(cart.position / POSITION_LIMIT)) / 2.0
        slow = (1.0 + _bell(pole.velocity / self.fast)) / 2.0
        return upright * centred * slow


def _bell(x: float) -> float:
    """Returns the bell curve 0.1 ** x²: 1 at 0, 0.1 at +-1."""
    return 0.1 ** (x * x)


TASKS: dict[str, type[CartPoleTask]] = {
    "balance": BalanceTask,
    "classic": ClassicTask,
    "swing-up": SwingUpTask,
}
"""The tasks by name; each can be made without arguments."""
