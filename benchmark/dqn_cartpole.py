#!/usr/bin/env python3
"""How fast and how reliably DQN solves CartPole-v1, and Stable-Baselines3's DQN beside it.

    ./ws extras python3 benchmark/dqn_cartpole.py [flags of workbench.py benchmark]

A training of ours ends when 110 greedy episodes of one policy confirm 495, at 50,000 steps at the latest;
Stable-Baselines3's runs its 50,000 steps. Both are evaluated every 1000 steps by the same rule.
"""

import sys

from learning_suites import run

if __name__ == "__main__":
    sys.exit(run("cartpole", "cartpole_sb3"))
