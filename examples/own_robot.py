#!/usr/bin/env python3
"""A robot of one's own: its URDF, its controllers and a task make an environment.

./ws python3 examples/own_robot.py
"""

from typing import Any

import gymnasium
import numpy as np

from robot_envs import Commands, InitialState, LinkQuery, Robot, RobotEnv, StateQuery, Task, WorldState

ARM = Robot(
    urdf="package://cartpole/urdf/two_link_arm.urdf.xacro",
    controllers="package://cartpole/config/robots/two_link_arm.yaml",
    run=("shoulder_controller", "elbow_controller"),
    control_period=0.04,  # [s] of an action
)


class Stretch(Task):
    """The tip goes as far ahead as it can."""

    max_steps = 50
    query = StateQuery(links=(LinkQuery("tip"),))

    def action_space(self) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)  # [rad/s]

    def observation_space(self) -> gymnasium.spaces.Box:
        return gymnasium.spaces.Box(-10.0, 10.0, (2,), np.float32)  # [rad]

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        return InitialState(joints={"elbow": rng.uniform(0.0, 1.5)})

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        return {"shoulder_controller": float(action[0]), "elbow_controller": float(action[1])}

    def observe(self, state: WorldState) -> np.ndarray:
        return np.array([state.joints[name].position for name in ("shoulder", "elbow")], np.float32)

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return state.links["tip"].pose.position[0]  # [m]


env: Any = RobotEnv(ARM, Stretch())
joints, _ = env.reset(seed=0)
for _ in range(50):
    joints, reward, *_ = env.step(np.clip(-joints, -1.0, 1.0))
print(f"joints at {joints[0]:+.3f} and {joints[1]:+.3f} rad; the tip is {reward:.3f} m ahead")
env.close()
