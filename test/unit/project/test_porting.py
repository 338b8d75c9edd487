"""The examples in docs/porting.md and docs/environments.md make environments that move."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from robot_envs import GoalTask, RobotEnv

DOCS = Path(__file__).resolve().parents[3] / "docs"
TOOLKITS = ("openai_ros", "frobs_rl", "gym-gazebo", "ros-gazebo-gym")
OWN = ("Another robot", "Another task")


def sections(page: str = "porting.md") -> dict[str, str]:
    text = (DOCS / page).read_text(encoding="utf-8")
    parts = re.split(r"^## (.*)\n", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def example(toolkit: str) -> RobotEnv:
    """The environment that the first block of a section makes, or those blocks together."""
    page = "environments.md" if toolkit in OWN else "porting.md"
    names = OWN if toolkit in OWN else (toolkit,)
    blocks = [re.findall(r"```python\n(.*?)```", sections(page)[name], re.DOTALL) for name in names]
    text = "\n".join(block[0] for block in blocks)
    made: dict[str, Any] = {}
    exec(compile(text, f"the example of {toolkit}", "exec"), made)
    return made["env"]


@pytest.mark.parametrize("toolkit", [*TOOLKITS, OWN[1]])
@pytest.mark.filterwarnings("ignore:.*maximum value is infinity|.*minimum value is -infinity")
def test_an_example_is_an_environment(toolkit: str) -> None:
    env = example(toolkit)
    try:
        check_env(env, skip_render_check=True)
        env.action_space.seed(0)
        first, _ = env.reset(seed=0)
        seen, rewards = [], []
        for _ in range(40):
            observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
            seen.append(str(observation))
            rewards.append(reward)
            if terminated or truncated:
                break
        assert len(set(seen)) > 2, "it moves"
        assert np.isfinite(rewards).all()
        assert isinstance(env.task, GoalTask) == isinstance(first, dict)
    finally:
        env.close()
