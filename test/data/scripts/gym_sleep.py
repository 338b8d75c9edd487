#!/usr/bin/env python3
"""A Gymnasium environment whose step unpauses, sleeps and pauses, trained by Stable-Baselines3."""

import hashlib
import sys
import time

import gymnasium
import numpy as np
import rospy
from gazebo_msgs.srv import SetModelConfiguration
from sensor_msgs.msg import JointState
from stable_baselines3 import PPO
from std_msgs.msg import Float64
from std_srvs.srv import Empty


class CartPoleEnv(gymnasium.Env):
    def __init__(self):
        self.action_space = gymnasium.spaces.Discrete(2)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (4,), np.float32)
        self.command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
        rospy.Subscriber("/joint_states", JointState, self.on_state, queue_size=1)
        self.unpause = rospy.ServiceProxy("/gazebo/unpause_physics", Empty)
        self.pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)
        self.reset_simulation = rospy.ServiceProxy("/gazebo/reset_simulation", Empty)
        self.place = rospy.ServiceProxy("/gazebo/set_model_configuration", SetModelConfiguration)
        self.state = np.zeros(4, np.float32)
        self.target = 0.0

    def on_state(self, message):
        self.state = np.array([*message.position, *message.velocity], np.float32)

    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        self.pause()
        self.reset_simulation()
        angle = self.np_random.uniform(-0.05, 0.05)
        self.place("cartpole", "robot_description", ["cart_pole"], [angle])
        self.target = 0.0
        self.let_pass(0.05)
        return self.state, {}

    def step(self, action):
        self.target += 0.02 if action else -0.02
        self.command.publish(self.target)
        self.let_pass(0.02)
        fell = abs(self.state[0]) > 0.21 or abs(self.state[1]) > 0.4
        return self.state, 1.0, bool(fell), False, {}

    def let_pass(self, seconds):
        self.unpause()
        time.sleep(seconds)
        self.pause()


rospy.init_node("gym_sleep")
rospy.wait_for_service("/gazebo/set_model_configuration")
steps = int(sys.argv[1])
model = PPO("MlpPolicy", CartPoleEnv(), n_steps=64, batch_size=32, n_epochs=2, device="cpu")
model.learn(steps)
weights = b"".join(each.detach().numpy().tobytes() for each in model.policy.parameters())
print(hashlib.sha256(weights).hexdigest(), model.num_timesteps, rospy.get_time())
