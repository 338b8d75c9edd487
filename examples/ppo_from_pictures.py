#!/usr/bin/env python3
"""Stable-Baselines3's PPO balances the cart-pole from pictures of 64 x 64 pixels.

    ./ws extras python3 examples/ppo_from_pictures.py --out runs/pictures

The camera is a sensor of the robot's URDF; the task observes what it has measured. Four frames are stacked,
so that the network sees motion. The folder gets the policy, and the curve in progress.csv.
"""

import argparse
import dataclasses

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.logger import configure
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecFrameStack

from cartpole.robot import ROBOT
from cartpole.tasks import ANGLE_LIMIT, POSITION_LIMIT, CartPoleState, ClassicTask
from robot_envs import EMPTY, RobotEnv, StateQuery, WorldState
from robot_envs.files import own_file

BLUE = slice(2, 3)  # the channel in which the orange pole is dark and the blue cart bright
WITH_CAMERA = dataclasses.replace(
    ROBOT,
    urdf=own_file("cartpole", "urdf/cartpole_camera.urdf.xacro"),
    world=EMPTY,  # the same in-process and over ROS: the camera sees it
    control_period=0.02,  # [s], that of the camera
)


class BalanceFromPictures(ClassicTask):
    """As Classic-v0 at 50 Hz, for 200 steps, but all that is observed is a picture.

    The reward of a step is 1 in the middle with the pole upright, and falls to 0 at the limits.
    """

    max_steps = 200
    query = StateQuery(sensors=("camera",))

    def observation_space(self) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(0, 255, (64, 64, 1), np.uint8)

    def observe(self, state: WorldState) -> np.ndarray:
        return state.sensors["camera"].image[..., BLUE]

    def reward(self, state: WorldState, action: int) -> float:
        true = CartPoleState.of(state)
        lean, way = true.pole_angle / ANGLE_LIMIT, true.cart_position / POSITION_LIMIT
        return max(0.0, 1.0 - 0.5 * lean**2 - 0.5 * way**2)


def make() -> Monitor:
    return Monitor(RobotEnv(WITH_CAMERA, BalanceFromPictures()))


def stacked(count: int) -> VecEnv:
    """Returns so many environments, whose observations are the last four frames."""
    return VecFrameStack(DummyVecEnv([make] * count), n_stack=4)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=150_000)
    parser.add_argument("--envs", type=int, default=8)
    parser.add_argument("--rollout", type=int, default=128, help="steps of each between updates")
    parser.add_argument("--evaluations", type=int, default=20, help="episodes in the end")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="runs/pictures")
    args = parser.parse_args()
    torch.set_num_threads(1)
    envs = stacked(args.envs)
    model = PPO(
        "CnnPolicy", envs, n_steps=args.rollout, batch_size=128, n_epochs=8, learning_rate=5e-4,
        seed=args.seed,
    )  # fmt: skip
    model.set_logger(configure(args.out, ["stdout", "csv"]))
    model.learn(args.steps)
    model.save(f"{args.out}/policy")
    count = args.evaluations
    returns, lengths = evaluate_policy(model, envs, count, return_episode_rewards=True)
    print(f"steps of 200: {np.mean(lengths):.1f}, return {np.mean(returns):.1f}")


if __name__ == "__main__":
    main()
