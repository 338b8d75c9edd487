#!/usr/bin/env python3
"""Plans in the very environment it acts in: model-predictive control by snapshots.

    ./ws python3 examples/plan_with_snapshots.py cart-pole                      # swings the pole up
    ./ws python3 examples/plan_with_snapshots.py rover                          # drives around a box
    ./ws python3 examples/plan_with_snapshots.py cart-pole --backend ros-own    # over ROS: the same bits
    ./ws python3 examples/plan_with_snapshots.py cart-pole --processes 2        # in parallel: the same bits

Nothing is learned. Random plans are tried from a snapshot of the present, and the first action of the best
one is done; the next plans vary the rest of it (predictive sampling).
"""

import argparse
import math
import multiprocessing
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import gymnasium
import numpy as np

import cartpole  # noqa: F401  registers cartpole/SwingUp-v0
import robot_envs.robots  # noqa: F401  registers robot_envs/Navigate-v0
from cartpole.tasks import ANGLE_LIMIT, CartPoleState
from robot_envs import EnvSnapshot, InitialState, Pose
from robot_sim.physics.pose import from_rpy

SECOND = 125  # steps of the cart-pole
SPREAD = 1.5  # largest standard deviation of an action from the last plan's; actions end at 1


class Problem(NamedTuple):
    """What is to be done, and how hard to think."""

    env_id: str
    begin: Callable[[Any, int], object]  # starts the environment's episode with a seed
    is_done: Callable[[Any, list[Any]], bool]  # by the task's info, and the states so far
    repeat: int  # steps for which an action is held
    horizon: int  # actions of a plan
    plans: int  # in each round
    rounds: int  # before each action


def stands(info: Any, states: list[Any]) -> bool:
    """Returns whether the pole has been upright for a second."""
    angles = [CartPoleState.of(state).pole_angle for state in states[-SECOND:]]
    upright = [abs(math.remainder(angle, math.tau)) < ANGLE_LIMIT for angle in angles]
    return len(upright) == SECOND and all(upright)


def face_the_box(env: Any, seed: int) -> None:
    """Puts the rover 1.1 m before a box of its room, and the goal as far behind it."""
    start = Pose((2.4, -0.4, 0.0), from_rpy(0.0, 0.0, math.pi))
    env.reset(seed=seed, options={"initial_state": InitialState(models={"rover": start})})
    env.task.aim((0.2, -0.4))


PROBLEMS = {
    "cart-pole": Problem("cartpole/SwingUp-v0", lambda env, seed: env.reset(seed=seed), stands, 5, 16, 16, 2),
    "rover": Problem(
        "robot_envs/Navigate-v0", face_the_box, lambda info, states: info["is_success"], 3, 6, 24, 1
    ),
}


def rewards(env: Any, actions: Iterable[np.ndarray]) -> Iterator[float]:
    """Does actions, as long as the episode lasts; yields the reward of each."""
    for action in actions:
        _, reward, terminated, truncated, _ = env.step(action)
        yield reward
        if terminated or truncated:
            return


def tried(env: Any, snapshot: EnvSnapshot, plans: np.ndarray, repeat: int) -> list[float]:
    """Returns the return of each plan, begun at the snapshot."""
    returns = []
    for plan in plans:
        env.restore_state(snapshot)
        returns.append(sum(rewards(env, plan.repeat(repeat, axis=0))))
    return returns


def work(pipe: Connection, problem: Problem) -> None:
    """Tries plans in a process of its own: snapshots come as bytes."""
    env: Any = gymnasium.make(problem.env_id).unwrapped
    pipe.send("ready")
    for snapshot, plans in iter(pipe.recv, None):
        env.restore_state(EnvSnapshot.from_bytes(snapshot))  # checked here, once
        pipe.send(tried(env, env.save_state(), plans, problem.repeat))
    env.close()


def in_parallel(pipes: Sequence[Connection], snapshot: EnvSnapshot, plans: np.ndarray) -> list[float]:
    """Returns the return of each plan, which as many processes have tried as there are pipes."""
    data = snapshot.to_bytes()
    for pipe, part in zip(pipes, np.array_split(plans, len(pipes)), strict=True):
        pipe.send((data, part))
    return [each for pipe in pipes for each in pipe.recv()]


def planned(env: Any, problem: Problem, seed: int, pipes: Sequence[Connection] = ()) -> Iterator[np.ndarray]:
    """Yields the next action again and again, each time with the environment as it was left."""
    rng = np.random.default_rng(seed)
    best = np.zeros((problem.horizon, *env.action_space.shape), np.float32)
    spread = np.linspace(0.0, SPREAD, problem.plans).reshape(-1, 1, 1)  # the first plan is the best
    while True:
        now = env.save_state()
        for _ in range(problem.rounds):
            plans = best + spread * rng.standard_normal((problem.plans, *best.shape))
            plans = plans.clip(-1.0, 1.0).astype(np.float32)
            if pipes:
                returns = in_parallel(pipes, now, plans)
            else:
                returns = tried(env, now, plans, problem.repeat)
            best = plans[np.argmax(returns)]
        env.restore_state(now)
        yield from [best[0]] * problem.repeat
        best = np.concatenate((best[1:], best[-1:]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problem", choices=PROBLEMS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--backend", help='as "mujoco" or "ros-own"; PyBullet in-process by default')
    parser.add_argument("--processes", type=int, default=1, help="that try plans, in-process")
    args = parser.parse_args()
    problem = PROBLEMS[args.problem]
    pipes = []
    for _ in range(args.processes if args.processes > 1 else 0):
        pipe, its = multiprocessing.Pipe()
        multiprocessing.Process(target=work, args=(its, problem), daemon=True).start()
        pipes.append(pipe)
    env: Any = gymnasium.make(problem.env_id, backend=args.backend).unwrapped
    problem.begin(env, args.seed)
    for pipe in pipes:
        pipe.recv()  # "ready"
    states, total, done, begin = [], 0.0, False, time.perf_counter()
    for reward in rewards(env, planned(env, problem, args.seed, pipes)):
        states.append(env.state)
        total += reward
        if done := problem.is_done(env.task.info(env.state), states):
            break
    simulated, took = len(states) * env.control_period, time.perf_counter() - begin
    print("done" if done else "not done", f"after {simulated:.2f} s, with a return of {total:.4f}")
    print(f"it took {took:.1f} s")
    for pipe in pipes:
        pipe.send(None)
    env.close()


if __name__ == "__main__":
    main()
