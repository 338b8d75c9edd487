"""The algorithms that can be trained, by the names that --algo knows."""

from cartpole.workbench.runs import POLICY_GRADIENT
from cartpole.workbench.sb3_settings import CLASSES

DQN = "dqn"
ALGORITHMS = (DQN, POLICY_GRADIENT, *CLASSES)  # ours, and Stable-Baselines3's
