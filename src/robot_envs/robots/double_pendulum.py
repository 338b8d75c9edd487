"""The double pendulum: a cart keeps two rods upright, one on top of the other."""

import gymnasium
import numpy as np

from robot_envs.robots import actions, numbers
from robot_envs.robots.own import own_robot
from robot_envs.task import Task
from robot_envs.world_state import InitialState, WorldState

JOINTS = ("cart_joint", "lower_joint", "upper_joint")
STRONGEST = 15.0  # [N] that an action asks for
LEAN = 0.5  # [rad] of a rod from the vertical, at which it counts as fallen
EDGE = 0.95  # [m] of the cart from the rail's middle

ROBOT = own_robot("double_pendulum", "cart_controller", control_period=0.02)


class Balance(Task):
    """Both rods are kept upright, and the cart in the middle of its rail.

    ## Action space
    `Box(-1, 1, (1,))`: the force on the cart [15 N].

    ## Observation space
    `Box((6,))`

    | numbers | what they are | unit |
    |---|---|---|
    | 0, 1 | position and speed of the cart | m, m/s |
    | 2, 3 | angle of the lower rod from the vertical, and its speed | 0.2 rad, 2 rad/s |
    | 4, 5 | the same of the upper rod, from the vertical, too | 0.2 rad, 2 rad/s |

    ## Rewards
    1 - 0.5 x² - 0.01 action² for each step, with the cart's position x [m].

    ## Start of an episode
    Upright in the middle, at rest: each joint's position and speed are off by up to `noise` [m, m/s, rad,
    rad/s].

    ## End of an episode
    Terminated when a rod is 0.5 rad from the vertical or the cart 0.95 m from the middle; truncated after 500
    steps of 0.02 s.
    """

    max_steps = 500

    def __init__(self, noise: float = 0.03) -> None:
        self.noise = noise

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(1)

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(6)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        off = rng.uniform(-self.noise, self.noise, (3, 2)).tolist()
        return InitialState(joints=dict(zip(JOINTS, map(tuple, off), strict=True)))

    def apply(self, action: np.ndarray, state: WorldState) -> dict[str, float]:
        return {"cart_controller": STRONGEST * float(action[0])}

    def observe(self, state: WorldState) -> np.ndarray:
        cart, lower, upper = rods(state)
        seen = [*cart, lower[0] / 0.2, lower[1] / 2.0, upper[0] / 0.2, upper[1] / 2.0]
        return np.array(seen, np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        off = state.joints["cart_joint"].position
        return 1.0 - 0.5 * off * off - 0.01 * float(np.square(action).sum())

    def is_terminal(self, state: WorldState) -> bool:
        """Returns whether a rod has fallen, or the cart is at the rail's end."""
        cart, lower, upper = rods(state)
        return abs(cart[0]) > EDGE or abs(lower[0]) > LEAN or abs(upper[0]) > LEAN


def rods(state: WorldState) -> list[tuple[float, float]]:
    """Returns position and speed: the cart's [m, m/s], and both rods' from the vertical [rad, rad/s]."""
    cart, lower, upper = (state.joints[name] for name in JOINTS)
    return [
        (cart.position, cart.velocity),
        (lower.position, lower.velocity),
        (lower.position + upper.position, lower.velocity + upper.velocity),
    ]
