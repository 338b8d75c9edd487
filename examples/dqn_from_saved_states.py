#!/usr/bin/env python3
r"""DQN that swings the pole up, with half of its episodes begun in states of one demonstration.

    ./ws python3 examples/dqn_from_saved_states.py demonstrate runs/places
    ./ws python3 examples/dqn_from_saved_states.py train --algo dqn --env-id SwingUpDiscrete-v0 \
        --train-env-kwargs places=runs/places --total-timesteps 60000 --stop-at-return 150 \
        --eval-frequency 2500 --confirm-episodes 20

Without `--train-env-kwargs` each episode begins with the hanging pole, as evaluations do in both cases.
docs/snapshots.md says how much sooner it learns.
"""

import math
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from cartpole.environment import CartPoleEnv
from cartpole.robot import CONTROLLER, POLE_JOINT
from cartpole.tasks import SwingUpTask
from rl_workbench import cli
from robot_envs import Commands, EnvSnapshot, InitialStates, WorldState

STEPS = np.array((-0.08, -0.03, 0.0, 0.03, 0.08))  # [m] that an action moves the cart's set-point
PERIOD = 0.04  # [s] of an action
HORIZON, PLANS, HOLD = 24, 48, 3  # actions of a plan, plans for each action, steps of one choice
SEED, DEMONSTRATED = 0, 125


class SwingUpDiscrete(SwingUpTask):
    """SwingUpTask with five actions, a sparse reward, and episodes of 10 s that may begin in saved states.

    The reward of a step is 1 while the pole stands, within 0.1 rad and slower than 0.5 rad/s; else 0.

    Args:
        places: Folder of snapshots; half of the episodes begin in one of them.
    """

    max_steps = 250

    def __init__(self, places: str | None = None) -> None:
        super().__init__()
        self.places = InitialStates(places) if places else None

    def action_space(self) -> Any:
        return gymnasium.spaces.Discrete(len(STEPS))

    def apply(self, action: Any, state: WorldState) -> Commands:
        return {CONTROLLER: state.commands[CONTROLLER] + float(STEPS[action])}

    def reward(self, state: WorldState, action: Any) -> float:
        angle, velocity = state.joints[POLE_JOINT][:2]
        return float(math.cos(angle) > math.cos(0.1) and abs(velocity) < 0.5)

    def initial_state(self, rng: np.random.Generator) -> Any:
        if self.places is not None and rng.random() < 0.5:
            return self.places.draw(rng)
        return super().initial_state(rng)


def make(places: str | None = None, backend: str | None = None, **others: Any) -> CartPoleEnv:
    """Makes the environment of the id."""
    return CartPoleEnv(SwingUpDiscrete(places), backend, control_period=PERIOD, **others)


def demonstrate(folder: Path) -> float:
    """Plans an episode by random shooting and saves the state before each action; returns the return."""
    folder.mkdir(parents=True)
    env: Any = gymnasium.make("SwingUpDiscrete-v0").unwrapped
    env.reset(seed=SEED)
    rng, total, best = np.random.default_rng(SEED), 0.0, np.zeros(HORIZON, int)
    for number in range(DEMONSTRATED):
        now = env.save_state()
        now.save(folder / f"{number:04}.snapshot")
        plans = rng.integers(len(STEPS), size=(PLANS, HORIZON // HOLD)).repeat(HOLD, axis=1)
        plans[0] = np.append(best[1:], best[-1])
        best = max(plans, key=lambda plan: tried(env, now, plan))
        env.restore_state(now)
        total += env.step(best[0])[1]
    env.close()
    return total


def tried(env: Any, snapshot: EnvSnapshot, plan: np.ndarray) -> float:
    """Returns the return of a plan, begun at a snapshot."""
    env.restore_state(snapshot)
    total = 0.0
    for action in plan:
        _, _, terminated, truncated, _ = env.step(action)
        total += SwingUpTask.reward(env.task, env.state, action)  # the dense one, which leads there
        if terminated or truncated:
            break
    return total


if __name__ == "__main__":
    gymnasium.register("SwingUpDiscrete-v0", entry_point=make)
    if sys.argv[1:2] == ["demonstrate"] and len(sys.argv) == 3:
        print(f"a return of {demonstrate(Path(sys.argv[2])):.1f}")
    else:
        sys.exit(cli.main(sys.argv[1:]))
