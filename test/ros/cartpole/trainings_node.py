#!/usr/bin/env python3
"""Trainings over ROS besides pg_train's: DQN, Stable-Baselines3, goals in the workbench."""

import rostest
from dqn_train_cases import DqnTrain
from readme_ppo_cases import ReadmePpo
from workbench_goals_cases import WorkbenchGoals

__all__ = ["DqnTrain", "ReadmePpo", "WorkbenchGoals"]

if __name__ == "__main__":
    rostest.rosrun("cartpole", "trainings", "__main__")
