"""Another task for the robot: the cart is to stand beside the middle, with the pole up.

A task is a class. Once its environment has a name, whatever asks for a name takes it:

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
    """All but start, length and reward is BalanceTask's; see there what else a task may change."""

    def __init__(self, place: float) -> None:
        super().__init__(noise=0.05)
        self.place, self.max_steps = place, 500  # [m], steps

    def reward(self, state: WorldState, action: int) -> float:
        """1 at the place, 0 at the end of the range that is farther from it."""
        cart = CartPoleState.of(state).cart_position
        return 1.0 - abs(cart - self.place) / (POSITION_LIMIT + abs(self.place))


def make(place: float = 0.2, backend: str | None = None, **others: Any) -> CartPoleEnv:
    """What stands behind the name; options as in --env-kwargs place=-0.1,backend=ros."""
    return CartPoleEnv(StandAt(place), backend, **others)


if __name__ == "__main__":
    gymnasium.register("StandAt-v0", entry_point=make)
    sys.exit(cli.main(sys.argv[1:]))
