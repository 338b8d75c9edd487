"""Twenty seeded steps of an environment from a file of a snapshot: `python3 play.py ID BACKEND FILE`."""

import sys

import gymnasium

import cartpole  # noqa: F401 - registers the environments
import robot_envs.robots  # noqa: F401
from robot_envs import EnvSnapshot
from robot_sim.plain_data import pack


def play(env: gymnasium.Env, seed: int = 5) -> str:
    """Returns what the steps gave, to the bit."""
    env.action_space.seed(seed)
    given = []
    for _ in range(20):
        given.append(env.step(env.action_space.sample()))
        if given[-1][2] or given[-1][3]:
            given.append(env.reset())
    return pack(given).hex()


if __name__ == "__main__":
    identifier, backend, file = sys.argv[1:]
    made = gymnasium.make(identifier, backend=backend).unwrapped
    made.restore_state(EnvSnapshot.load(file))
    print("played", play(made))
