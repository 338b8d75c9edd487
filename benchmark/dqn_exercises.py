#!/usr/bin/env python3
"""The tutorial's exercises: discount factors 0.5 and 0.999, a replay of size 1, Acrobot-v1.

./ws python3 benchmark/dqn_exercises.py [flags of workbench.py benchmark]
"""

import sys

from learning_suites import run

if __name__ == "__main__":
    sys.exit(run("exercises", "exercise_acrobot"))
