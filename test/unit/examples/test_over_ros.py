"""The examples over ROS play their episodes, each with a simulator of its own."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ros_utils.simulation import reserved_port

ROOT = Path(__file__).resolve().parents[3]
LIMIT = 300.0  # [s] for a process

pytestmark = pytest.mark.slow


def printed(*words: str) -> str:
    """Runs a Python program beside a master of its own."""
    uri = f"http://127.0.0.1:{reserved_port()}"
    ended = subprocess.run(
        [sys.executable, *words], env={**os.environ, "ROS_MASTER_URI": uri}, timeout=LIMIT,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def test_episodes_over_services_balance_in_lockstep() -> None:
    text = printed(f"{ROOT}/scripts/lockstep.py", f"{ROOT}/examples/episode_over_services.py")
    told = [line.partition(", ")[0] for line in text.splitlines() if "ends at" in line]
    assert told == [f"episode {n}: 200 steps" for n in range(3)]


def test_random_changes_of_a_policy_learn() -> None:
    example = f"{ROOT}/examples/learn_over_services.py"
    text = printed(f"{ROOT}/scripts/lockstep.py", "--seed=0", example)
    returns = dict.fromkeys(range(60), 0.0)
    for episode, reward in re.findall(r"Episode (\d+), .*Reward=(\S+)", text):
        returns[int(episode)] += float(reward)
    assert min(list(returns.values())[-10:]) > 180.0 > returns[0]


def test_the_tests_of_a_robot_pass() -> None:
    file = f"{ROOT}/examples/test_robot_without_gazebo.py"
    assert "3 passed" in printed("-m", "pytest", "-q", "-p", "no:cacheprovider", file)
