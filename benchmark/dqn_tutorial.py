#!/usr/bin/env python3
"""How often the tutorial's own DQN, with its defaults, reaches 475 in its 500 episodes.

    ./ws python3 benchmark/dqn_tutorial.py [flags of workbench.py benchmark]

The column avg20 is the largest value of the tutorial's own column Avg(20).
"""

import sys

from learning_suites import run

if __name__ == "__main__":
    sys.exit(run("tutorial"))
