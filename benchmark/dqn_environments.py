#!/usr/bin/env python3
"""DQN in Acrobot-v1, MountainCar-v0 and LunarLander-v3, with the options of config/dqn.yaml.

./ws extras python3 benchmark/dqn_environments.py [flags of workbench.py benchmark]
"""

import sys

from learning_suites import run

if __name__ == "__main__":
    sys.exit(run("acrobot", "mountain_car", "lunar_lander"))
