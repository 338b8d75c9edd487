"""The algorithms that can be trained, by the names that --algo knows."""

from rl_workbench.tools.runs.runs import POLICY_GRADIENT
from rl_workbench.training.sb3.settings import CLASSES

DQN = "dqn"
ALGORITHMS = (DQN, POLICY_GRADIENT, *CLASSES)  # ours, and Stable-Baselines3's
