"""An error that comes up in our code, but is the user's, is told with the place in theirs."""

import gymnasium
import pytest
from support.scenes.solo_arm import SOLO, Hold

from rl_workbench.training.environments.checked import CheckedEnvironment, EnvironmentFailure
from robot_envs import RobotEnv


def test_a_wrong_name_is_told_with_the_tasks_own_line():
    def observe(state):
        return state.joints["elbo"].position

    env: gymnasium.Env = CheckedEnvironment(RobotEnv(SOLO, Hold(observe=observe)), "my/Arm-v0")
    with pytest.raises(EnvironmentFailure) as error:
        env.reset(seed=0)
    env.close()
    line = observe.__code__.co_firstlineno + 1
    assert f"'elbo'; did you mean 'elbow'? ({__file__}:{line})" in str(error.value)
