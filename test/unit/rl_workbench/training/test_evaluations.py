"""Evaluations while a training runs: when, in which environment, and which policy is the best one."""

from pathlib import Path
from typing import ClassVar

import gymnasium
import pytest
from support.training import training_runs
from support.training.goal_environments import REACH, SHARED_REACH
from support.training.learning_fakes import POLE, Dicing, OnlyOne, Pole, register_with
from support.training.training_runs import EXACT, OTHERS, checkpoint, rows, run, summary, train

from rl_workbench.errors import WorkbenchError
from rl_workbench.training import evaluator
from rl_workbench.training.evaluator import Evaluation

pytestmark = pytest.mark.slow

MANY = {"total_timesteps": 400, "episodes": 0, "stop_at_length": 0}


@pytest.fixture
def robot(monkeypatch) -> type[Pole]:
    """An environment, registered, that notes the options of each one that is made."""

    class Robot(Pole):
        made: ClassVar[list[dict]] = []
        shares_robot = False

        def __init__(self, **options: object) -> None:
            self.made.append(options)
            super().__init__(0.05)

    register_with(monkeypatch, Robot)
    return Robot


@pytest.mark.parametrize("name", EXACT)
def test_an_evaluation_is_due_where_a_multiple_is_passed(tmp_path: Path, name: str) -> None:
    result = summary(train(tmp_path, name, **MANY, eval_frequency=50))
    ends, total = [], 0
    for length in result["lengths"] if name != "dqn" else [1] * result["steps"]:
        total += length
        if total // 50 > (total - length) // 50:
            ends.append(total)
    assert ends[-1] == result["steps"] or name != "dqn"
    at_the_end = [] if ends[-1] == result["steps"] else [result["steps"]]
    assert [step for step, _ in result["evaluations"]] == ends + at_the_end


@pytest.mark.parametrize("name", training_runs.ALL)
def test_the_best_is_that_of_the_best_evaluation(tmp_path: Path, name: str) -> None:
    changed = {"confirm_episodes": 0, "eval_frequency": 50}
    result = summary(train(tmp_path, name, **changed))
    assert len(result["evaluations"]) > 2
    assert result["best"] == max(result["evaluations"], key=lambda each: each[1])
    best = checkpoint(tmp_path, "best.pt")
    assert best["steps"] == result["best"][0]
    own = best.get("best_at_the_end", best["history"]["best"])
    assert own == result["best"], "it knows its own score"


@pytest.mark.parametrize("name", ["dqn", "reinforce", *OTHERS[:1]])
def test_prolonged_no_worse_one_becomes_the_best(tmp_path: Path, monkeypatch, name: str) -> None:
    """Also if that was found at the end, of which the last checkpoint doesn't know otherwise."""
    verdicts = [5.0, 9.0, *[7.0] * 9]
    monkeypatch.setattr(evaluator, "run_greedily", lambda *_: Evaluation([1], [verdicts.pop(0)]))
    numbers = {"confirm_episodes": 0, "episodes": 0, "eval_frequency": 128, "total_timesteps": 192}
    first = summary(train(tmp_path, name, **numbers))
    assert [mean for _, mean in first["evaluations"]] == [5.0, 9.0]
    assert first["best"] == [first["steps"], 9.0]
    longer = summary(training_runs.resume(tmp_path, total_timesteps=384))
    assert len(longer["evaluations"]) >= 2
    assert longer["best"] == first["best"]
    best = checkpoint(tmp_path, "best.pt")
    assert (best["steps"], best["best_at_the_end"]) == (first["steps"], first["best"])


@pytest.mark.parametrize("name", ["dqn", *OTHERS[:1]])
def test_more_episodes_confirm_the_best_policy(tmp_path: Path, monkeypatch, name: str) -> None:
    def evaluated(env, act, seed: int, episodes: int, stop) -> Evaluation:
        asked.append((seed, episodes))
        return Evaluation([1], [verdicts.pop(0)])

    verdicts, asked = [5.0, 4.0, 9.0, 3.0, 3.5, 7.0, 6.0], []
    monkeypatch.setattr(evaluator, "run_greedily", evaluated)
    numbers = {"eval_frequency": 64, "eval_episodes": 3, "confirm_episodes": 6}
    result = summary(train(tmp_path, name, **numbers, total_timesteps=256, seed=7))
    assert [mean for _, mean in result["evaluations"]] == [5.0, 9.0, 3.5, 7.0]
    assert result["best"] == [256, 6.0]
    confirmed = [row[::2] for row in rows(tmp_path) if row[1] == "eval/confirmed_reward"]
    assert confirmed == [("64", "4.0"), ("256", "6.0")]
    first, more = (1_000_007, 3), (2_000_007, 6)
    assert asked == [first, more, first, more, first, first, more]


@pytest.mark.parametrize("name", EXACT)
def test_training_and_evaluation_may_have_options_of_their_own(robot, tmp_path, name) -> None:
    options = {"env_kwargs": {"a": 1, "b": 1}, "train_env_kwargs": {"a": 2},
               "eval_env_kwargs": {"b": 3}}  # fmt: skip
    train(tmp_path, name, env_id="Robot-v0", **options, total_timesteps=60)
    assert robot.made == [{"a": 2, "b": 1}, {"a": 2, "b": 3}]


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("kind", [Dicing, OnlyOne])
def test_an_evaluation_draws_from_no_shared_generator(tmp_path, monkeypatch, kind, name) -> None:
    env_id = register_with(monkeypatch, kind)
    options = {"env_id": env_id, "env_kwargs": None, "confirm_episodes": 0, "total_timesteps": 200}
    plain = train(tmp_path / "plain", name, **options, eval_frequency=0)
    evaluated = train(tmp_path / "evaluated", name, **options, eval_frequency=30)
    assert len(summary(evaluated)["evaluations"]) > 3
    assert summary(plain)["returns"] == summary(evaluated)["returns"]


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("shared", [False, True])
def test_an_evaluation_moves_the_one_robot(robot, tmp_path, monkeypatch, name, shared) -> None:
    monkeypatch.setattr(robot, "shares_robot", shared)
    short = {"env_id": "Robot-v0", "total_timesteps": 60}
    train(tmp_path / "run", name, env_kwargs=None, **short)
    assert len(robot.made) == (1 if shared else 2)
    robot.made.clear()
    train(tmp_path / "other", name, eval_env_kwargs={"backend": "simulated"}, **short)
    assert len(robot.made) == 2


@pytest.mark.parametrize("name", EXACT)
def test_one_robot_learns_as_if_nobody_had_moved_it(robot, tmp_path, monkeypatch, name) -> None:
    options = {"env_id": "Robot-v0", "eval_frequency": 30, "total_timesteps": 300}
    whole = train(tmp_path / "whole", name, **options)
    monkeypatch.setattr(robot, "shares_robot", True)
    run = train(tmp_path / "run", name, training_runs.InterruptAfter(150), **options)
    assert rows(run) != rows(whole), "interrupted"
    training_runs.assert_same_run(whole, training_runs.resume(run))


@pytest.mark.parametrize("name", ["dqn", *OTHERS[:1]])
@pytest.mark.parametrize(("kind", "says_so"), [(OnlyOne, True), (Dicing, False)])
def test_where_a_robot_cannot_be_brought_back_the_episode_is_given_up(
    tmp_path: Path, monkeypatch, capsys, kind: type, says_so: bool, name: str
) -> None:
    env_id = register_with(monkeypatch, kind)
    monkeypatch.setattr(kind, "shares_robot", True, raising=False)
    monkeypatch.setattr(gymnasium.registry[env_id], "nondeterministic", says_so)
    options = {"total_timesteps": 128, "eval_frequency": 25}
    result = summary(train(tmp_path, name, env_id=env_id, **options))
    assert "the environment is not repeatable: the current episode" in capsys.readouterr().err
    assert result["complete"]
    evaluated = [25, 50, 75, 100, 125, 128] if name == "dqn" else [64, 128]  # between rollouts
    assert [step for step, _ in result["evaluations"]] == evaluated
    assert sum(result["lengths"]) < 128, "those that were given up don't count"


@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("ppo", {}),
        ("sac", {"learning_starts": 30, "batch_size": 8}),
        ("td3", {"her": True, "learning_starts": 10, "batch_size": 8, "action_noise": 0.2}),
    ],
)
def test_stable_baselines_moves_the_one_robot_and_learns_the_same(tmp_path, name, options) -> None:
    """Evaluated in the midst of episodes, of 20 steps each."""
    given = {"total_timesteps": 64, "n_steps": 32, "net_arch": "8", "eval_frequency": 25,
             "eval_episodes": 2, "checkpoint_frequency": 0, "seed": 3, **options}  # fmt: skip
    if name != "ppo":
        del given["n_steps"]
    alone, shared = (
        run(training_runs.options_of(name, {"env_id": env_id, **given}), tmp_path / env_id[6:])
        for env_id in (REACH, SHARED_REACH)
    )
    evaluated = [32, 64] if name == "ppo" else [25, 50, 64]
    assert [step for step, _ in summary(shared)["evaluations"]] == evaluated
    assert rows(alone) == rows(shared)
    for part in ("policy", "buffer"):
        training_runs.assert_same(checkpoint(alone).get(part), checkpoint(shared).get(part), part)


@pytest.mark.parametrize("name", ["dqn", "reinforce"])
def test_an_environment_of_which_there_can_be_only_one(tmp_path, monkeypatch, capsys, name) -> None:
    """It says nothing of a robot that it shares: as somebody writes it around a connection."""

    class Alone(Pole):
        count = 0

        def __init__(self) -> None:
            Alone.count += 1
            if Alone.count > 1:
                raise ConnectionError("the port is taken")
            super().__init__(0.05)

        def close(self) -> None:
            Alone.count -= 1

    env_id = register_with(monkeypatch, Alone)
    short = {"total_timesteps": 200}
    plain = train(tmp_path / "plain", name, env_id=POLE, env_kwargs={"noise": 0.05}, **short)
    alone = train(tmp_path / "alone", name, env_id=env_id, env_kwargs=None, **short)
    told = capsys.readouterr().out
    assert "evaluating in the training's environment, because a second one can't be made: " in told
    assert "the port is taken" in told
    assert rows(plain) == rows(alone)
    with pytest.raises(WorkbenchError, match="the port is taken"):
        train(tmp_path / "other", name, env_id=env_id, eval_env_kwargs={"noise": 0.1})
