"""The conformance suite of robot environments, as one call for your own tests."""

from robot_envs.testing.episodes import check_stands
from robot_envs.testing.rollouts import differences, rollout
from robot_envs.testing.suite import check_robot_env

__all__ = ["check_robot_env", "check_stands", "differences", "rollout"]
