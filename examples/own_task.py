"""Another task for the robot: the cart is to stand beside the middle, with the pole up.

A task is a class. Once an environment made of it has a name, everything that asks for a name takes it:

    ./ws python3 examples/own_task.py train --algo reinforce --env-id StandAt-v0 --run-dir runs/mine
    ./ws python3 examples/own_task.py record runs/mine --out episode.gif
"""

import sys
from typing import Any

import gymnasium

from cartpole.environment import CartPoleEnv
from cartpole.robot import CONTROL_PERIOD, ROBOT
from cartpole.tasks import POSITION_LIMIT, BalanceTask, CartPoleState
from rl_workbench import cli
from robot_envs.backends.choice import make_backend


class StandAt(BalanceTask):
    """All but start, length and reward is BalanceTask's; see there what else a task may change."""

    def __init__(self, place: float) -> None:
        super().__init__(noise=0.05, max_steps=500)
        self.place = place  # [m]

    def reward(self, state: CartPoleState) -> float:
        """1 at the place, 0 at the end of the range that is farther from it."""
        return 1.0 - abs(state.cart_position - self.place) / (POSITION_LIMIT + abs(self.place))


def make(place: float = 0.2, backend: str = "bullet", **others: Any) -> CartPoleEnv:
    """What stands behind the name; options go through, as in --env-kwargs place=-0.1,backend=ros."""
    return CartPoleEnv(make_backend(ROBOT, backend, CONTROL_PERIOD), StandAt(place), **others)


if __name__ == "__main__":
    gymnasium.register("StandAt-v0", entry_point=make)
    sys.exit(cli.main(sys.argv[1:]))
