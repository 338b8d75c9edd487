"""What every environment of robots promises, as one call for a test of one's own.

from robot_envs.testing import check_robot_env

def test_my_arm():
    check_robot_env("my_arm/Reach-v0", backends=("bullet", "ros"))
"""

from robot_envs.testing.rollouts import differences, rollout
from robot_envs.testing.suite import check_robot_env

__all__ = ["check_robot_env", "differences", "rollout"]
