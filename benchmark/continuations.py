#!/usr/bin/env python3
"""Whether snapshots keep their promise: each continuation is that of the original, to the bit.

    ./ws extras python3 benchmark/continuations.py [--out FOLDER] [--continuations 100] [--ids ID,ID]

An environment is saved in the middle of an episode, and continued at random by seeds, 50 steps each. From
the snapshot the same is done (a) again, (b) in a fresh process, from a file, (c) in another environment that
has done something else before, and (d) by PyBullet in-process where it was saved over ROS, and the other way
round. Prints a table of the continuations that were equal, and writes continuations.json.
"""

import hashlib
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import gymnasium
import reporting

import cartpole  # noqa: F401 - registers the environments
import robot_envs.robots  # noqa: F401
from robot_envs import EnvSnapshot, RobotEnv
from robot_sim.plain_data import pack

IDS = (
    "cartpole/Balance-v0", "cartpole/SwingUp-v0", "robot_envs/TwoLinkReach-v0",
    "robot_envs/TwoLinkReachGoal-v0", "robot_envs/SixJointReach-v0", "robot_envs/PickCube-v0",
    "robot_envs/PickCubeGoal-v0", "robot_envs/Furuta-v0", "robot_envs/DoublePendulum-v0",
    "robot_envs/Hopper-v0", "robot_envs/Quadruped-v0", "robot_envs/Navigate-v0",
    "robot_envs/NavigateImages-v0",
)  # fmt: skip
BACKENDS = ("bullet", "mujoco", "ros-own")
OTHER = {"bullet": "ros-own", "ros-own": "bullet"}
STEPS = 50
COLUMNS = ("again", "fresh process", "other world", "other backend")


def made(identifier: str, backend: str) -> RobotEnv:
    env = gymnasium.make(identifier, backend=backend).unwrapped
    assert isinstance(env, RobotEnv)
    return env


def play(env: RobotEnv, seed: int, steps: int = STEPS) -> str:
    """Returns a digest of what random actions lead to; an ended episode is followed by the next one."""
    env.action_space.seed(seed)
    seen = hashlib.sha256()
    for _ in range(steps):
        given: Any = env.step(env.action_space.sample())
        seen.update(pack(given))
        if given[2] or given[3]:
            seen.update(pack(env.reset()))
    return seen.hexdigest()


def continuations(env: RobotEnv, snapshot: EnvSnapshot, count: int) -> list[str]:
    digests = []
    for seed in range(count):
        env.restore_state(snapshot)
        digests.append(play(env, seed))
    return digests


def elsewhere(identifier: str, backend: str, path: Path, used: bool, count: int) -> list[str]:
    """Returns continuations from a file in an environment that is made for them."""
    env = made(identifier, backend)
    try:
        if used:
            env.reset(seed=77)
            play(env, 9, 7)
        return continuations(env, EnvSnapshot.load(path), count)
    finally:
        env.close()


def in_a_fresh_process(identifier: str, backend: str, path: Path, count: int) -> list[str]:
    program = (
        "import sys; from pathlib import Path; from continuations import elsewhere; "
        "_, name, backend, path, count = sys.argv; "
        "print('digests', *elsewhere(name, backend, Path(path), False, int(count)))"
    )
    command = [sys.executable, "-c", program, identifier, backend, str(path), str(count)]
    done = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True)
    return done.stdout.rpartition("digests")[2].split()


def main() -> None:
    chosen = reporting.options(__doc__ or "", continuations=100, ids=",".join(IDS))
    count, results, wrong = chosen.continuations, {}, 0
    print("{:38} {:>9} {:>14} {:>12} {:>14} {:>9}".format("", *COLUMNS, "[bytes]"))
    for identifier in chosen.ids.split(","):
        for backend in BACKENDS:
            env = made(identifier, backend)
            env.reset(seed=3)
            play(env, 1, 13)
            snapshot = env.save_state()
            first = [play(env, 0)]  # the original's own
            env.restore_state(snapshot)
            again = continuations(env, snapshot, count)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder, "there.snapshot")
                snapshot.save(path)
                size = path.stat().st_size
                fresh = in_a_fresh_process(identifier, backend, path, count)
                other = elsewhere(identifier, backend, path, True, count)
                across = backend in OTHER and elsewhere(identifier, OTHER[backend], path, False, count)
            env.close()
            same = [sum(a == b for a, b in zip([*first, *again[1:]], each, strict=True))
                    for each in (again, fresh, other, *([across] if across else []))]  # fmt: skip
            wrong += sum(each != count for each in same)
            cells = [f"{each} of {count}" for each in same] + ["-"] * (len(COLUMNS) - len(same))
            name = f"{identifier.partition('/')[2]}, {backend}"
            results[name] = [*cells, size]
            print("{:38} {:>9} {:>14} {:>12} {:>14} {:>9}".format(name, *cells, size), flush=True)
    reporting.write(chosen.out, "continuations", results)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
