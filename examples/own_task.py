"""A task of one's own for the robot: keep the cart beside the middle, with the pole up.

A task is a class. Once its environment is registered, every command accepts its id:

    ./ws python3 examples/own_task.py train --algo reinforce --env-id StandAt-v0 --run-dir runs/mine
    ./ws python3 examples/own_task.py record runs/mine --out episode.gif
"""

import sys
from typing import Any

import gymnasium

from cartpole.environment import CartPoleEnv
from cartpole.tasks import POSITION_LIMIT, BalanceTask, CartPoleState
from rl_workbench import cli
from robot_envs import WorldState


class StandAt(BalanceTask):
    """BalanceTask with another start, length and reward; see there for what else a task can change."""

    def __init__(self, place: float) -> None:
        super().__init__(noise=0.05)
        self.place, self.max_steps = place, 500  # [m], steps

    def reward(self, state: WorldState, action: int) -> float:
        """Returns 1 at the place, falling to 0 at the farther end of the range."""
        cart = CartPoleState.of(state).cart_position
        return 1.0 - abs(cart - self.place) / (POSITION_LIMIT + abs(self.place))


def make(place: float = 0.2, backend: str | None = None, **others: Any) -> CartPoleEnv:
    """Makes the environment of the id; options as in --env-kwargs place=-0.1,backend=ros."""
    return CartPoleEnv(StandAt(place), backend, **others)


if __name__ == "__main__":
    gymnasium.register("StandAt-v0", entry_point=make)
    sys.exit(cli.main(sys.argv[1:]))
