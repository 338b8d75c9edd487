"""The examples over ROS play their episodes, each with a simulator of its own."""

import re
from pathlib import Path

import pytest

LOCKSTEP = Path(__file__).resolve().parents[3] / "scripts/lockstep.py"

pytestmark = pytest.mark.slow


def test_episodes_over_services_balance_in_lockstep(printed) -> None:
    text = printed(LOCKSTEP, "episode_over_services.py")
    told = [line.partition(", ")[0] for line in text.splitlines() if "ends at" in line]
    assert told == [f"episode {n}: 200 steps" for n in range(3)]


def test_random_changes_of_a_policy_learn(printed, tmp_path: Path) -> None:
    """In two thirds of its episodes."""
    code = (LOCKSTEP.parents[1] / "examples/learn_over_services.py").read_text()
    (tmp_path / "learn.py").write_text(code.replace("EPISODES, STEPS = 60,", "EPISODES, STEPS = 40,"))
    text = printed(LOCKSTEP, "--seed=0", tmp_path / "learn.py")
    returns = dict.fromkeys(range(40), 0.0)
    for episode, reward in re.findall(r"Episode (\d+), .*Reward=(\S+)", text):
        returns[int(episode)] += float(reward)
    assert min(list(returns.values())[-6:]) > 180.0 > returns[0]


def test_the_tests_of_a_robot_pass(printed) -> None:
    words = ("-m", "pytest", "-q", "-p", "no:cacheprovider", "test_robot_without_gazebo.py")
    assert "3 passed" in printed(*words)
