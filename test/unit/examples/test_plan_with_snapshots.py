"""examples/plan_with_snapshots.py does what it plans for, and the same over ROS."""

import itertools
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest

pytestmark = pytest.mark.slow


@pytest.fixture
def example(imported) -> Any:
    return imported("plan_with_snapshots")


@pytest.mark.parametrize("name", ["cart-pole", "rover"])
def test_it_gets_there(example: Any, name: str, monkeypatch, capsys) -> None:
    """With less thought than it takes by itself."""
    monkeypatch.setitem(example.PROBLEMS, name, example.PROBLEMS[name]._replace(rounds=1, plans=8))
    monkeypatch.setattr(sys, "argv", ["plan_with_snapshots.py", name])
    example.main()
    assert capsys.readouterr().out.startswith("done after ")


def test_processes_find_the_same(example: Any, monkeypatch, capsys) -> None:
    quick = example.PROBLEMS["rover"]._replace(plans=5, horizon=3, is_done=lambda _, states: len(states) > 5)
    monkeypatch.setitem(example.PROBLEMS, "rover", quick)
    said = []
    for count in ("1", "2"):
        monkeypatch.setattr(sys, "argv", ["plan_with_snapshots.py", "rover", "--processes", count])
        example.main()
        said.append(capsys.readouterr().out.splitlines()[0])
    assert said[0] == said[1] and "return of" in said[0]


def test_straight_ahead_the_rover_meets_the_box(example: Any) -> None:
    env: Any = gymnasium.make(example.PROBLEMS["rover"].env_id).unwrapped
    example.face_the_box(env, 0)
    ahead = itertools.repeat(np.array([1.0, 0.0], np.float32))
    assert list(example.rewards(env, ahead))[-1] < -4.0
    assert env.task.info(env.state)["touched"]
    env.close()


@pytest.mark.parametrize("name", ["cart-pole", "rover"])
def test_over_ros_it_gets_the_same_bits(example: Any, name: str) -> None:
    problem = example.PROBLEMS[name]._replace(plans=3, horizon=4)

    def first_steps(**options: Any) -> tuple[list[float], Any]:
        env: Any = gymnasium.make(problem.env_id, **options).unwrapped
        problem.begin(env, 5)
        actions = example.planned(env, problem, 5)
        found = list(itertools.islice(example.rewards(env, actions), 4 * problem.repeat)), env.state
        env.close()
        return found

    assert first_steps() == first_steps(backend="ros-own")
