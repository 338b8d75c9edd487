#!/usr/bin/env python3
"""What each of DQN's options is worth on CartPole-v1: added to the tutorial's, taken from the tuned ones.

./ws python3 benchmark/dqn_ablation.py [flags of workbench.py benchmark]
"""

import sys

from learning_suites import run

if __name__ == "__main__":
    sys.exit(run("ablation_tutorial", "ablation_tuned"))
