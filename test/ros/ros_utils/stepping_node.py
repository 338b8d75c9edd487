#!/usr/bin/env python3
"""The client for lock-step, and what a step reports; simulators on masters of their own."""

import rostest
from step_client_cases import OneRobot, OwnSimulators
from step_state_cases import OnBullet, OnMujoco

__all__ = ["OnBullet", "OnMujoco", "OneRobot", "OwnSimulators"]

if __name__ == "__main__":
    rostest.rosrun("cartpole", "stepping", "__main__")
