"""REINFORCE in several environments: rounds, the bits of each, the way back, and which one fails."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.training import learning_fakes
from support.training import training_runs as runs
from support.training.learning_fakes import POLE, Elsewhere, Fragile, OnlyOne, Pole, register_with
from support.training.training_runs import assert_same, checkpoint, resume, summary, train

from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.environments import make_environment
from rl_workbench.training.episodes import EpisodeSource

NOISY = {"env_id": POLE, "env_kwargs": {"noise": 0.05}}
MANY = {**NOISY, "num_envs": 3, "batch_episodes": 2, "episodes": 14}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(tmp_path_factory.mktemp("whole"), "reinforce", **MANY)


class Copied(OnlyOne):
    """One robot, of which there is a copy for who asks for it."""

    def __init__(self, copy: bool = False) -> None:
        self.shares_robot = not copy
        self.own_robot_options = None if copy else {"copy": True}


def test_each_plays_what_it_would_play_alone() -> None:
    def environments() -> list[gymnasium.Env]:
        return [make_environment(POLE, {"noise": 0.05}) for _ in range(3)]

    agent = ReinforceAgent(7, environments=3)
    source = EpisodeSource(environments(), agent, 7)
    source.seed()
    rounds = [source.collect(lambda: False) for _ in range(2)]
    for index, env in enumerate(environments()):
        first = ReinforceAgent(7).generator
        agent.generator = np.random.default_rng((7, index)) if index else first
        env.reset(seed=7 + index)
        for episodes in rounds:
            alone = learning_fakes.run_episode(env, agent)
            assert_same(alone.state_dict(), episodes[index].state_dict())
    lengths = [[episode.length for episode in episodes] for episodes in rounds]
    assert len({length for each in lengths for length in each}) > 3, "they differ"


@pytest.mark.slow
def test_rounds_are_whole_and_batches_are_of_all(tmp_path: Path) -> None:
    run = train(tmp_path / "run", "reinforce", **MANY)
    assert summary(run)["episodes"] == 15, "whole rounds of three"
    lengths = summary(run)["lengths"]
    ends = [sum(lengths[: 3 * count]) for count in range(1, 6)]
    evaluated = [step for step, _ in summary(run)["evaluations"]]
    assert evaluated and set(evaluated) <= set(ends), "between rounds"
    updates = [step for step, tag, _ in runs.rows(run) if tag == "losses/policy_loss"]
    assert updates == [str(ends[1]), str(ends[3])], "two episodes of each of the three"
    assert len(checkpoint(run)["agent"]["batch"]) == 3
    longer = train(tmp_path / "longer", "reinforce", **MANY | {"episodes": 21})
    runs.assert_same_run(longer, resume(run, episodes=21))


@pytest.mark.slow
@pytest.mark.parametrize("asked", [40, 333, 700])
def test_broken_off_in_a_round_it_comes_to_the_same_bits(whole: Path, tmp_path, asked: int) -> None:
    broken = train(tmp_path / "broken", "reinforce", runs.InterruptAfter(asked), **MANY)
    assert not summary(broken)["complete"] and len(runs.rows(broken)) < len(runs.rows(whole))
    runs.assert_same_run(whole, resume(broken))
    runs.assert_no_doubles(broken)


@pytest.mark.slow
def test_steps_are_begun_in_all_before_one_is_taken(whole, tmp_path: Path, monkeypatch) -> None:
    env_id = register_with(monkeypatch, Elsewhere)
    options = MANY | {"env_id": env_id, "env_kwargs": {"noise": 0.05}}
    Elsewhere.calls.clear()
    begun = train(tmp_path / "begun", "reinforce", runs.InterruptAfter(333), **options)
    calls = Elsewhere.calls
    assert [name for name, _ in calls[:3]] == ["begin"] * 3
    assert [name for name, _ in calls[3:9]] == ["step", "begin"] * 3
    assert [which for _, which in calls[:3]] == [which for _, which in calls[3:9:2]]
    resume(begun)
    assert_same(checkpoint(whole)["agent"], checkpoint(begun)["agent"])


@pytest.mark.slow
def test_the_one_that_fails_is_named(tmp_path: Path, monkeypatch) -> None:
    env_id = register_with(monkeypatch, Fragile)
    monkeypatch.setattr(Fragile, "made", 0)
    options = MANY | {"env_id": env_id, "env_kwargs": None}
    line = runs.failure(lambda: train(tmp_path / "broken", "reinforce", **options))
    assert line.startswith("environment 2 of 3: its simulator has ended; ")
    assert "progress is saved" in line
    whole = train(tmp_path / "whole", "reinforce", **options)  # those are not the second one
    assert_same(checkpoint(whole)["agent"], checkpoint(resume(tmp_path / "broken"))["agent"])


@pytest.mark.slow
def test_a_round_without_anything_to_learn_is_given_up(whole, tmp_path, monkeypatch) -> None:
    updated = ReinforceAgent._update

    def failing(agent: ReinforceAgent, batch: list) -> None:
        monkeypatch.setattr(ReinforceAgent, "_update", updated)
        raise WorkbenchError("the policy loss is nan")

    monkeypatch.setattr(ReinforceAgent, "_update", failing)
    with pytest.raises(WorkbenchError, match="the policy loss is nan; .* 3 episodes, progress"):
        train(tmp_path, "reinforce", **MANY)
    runs.assert_same_run(whole, resume(tmp_path))


def test_one_that_can_not_be_made_is_named(tmp_path: Path, monkeypatch) -> None:
    class Rare(Pole):
        made = 0

        def __init__(self) -> None:
            Rare.made += 1
            if Rare.made == 3:
                raise ConnectionError("the port is taken")
            super().__init__()

    env_id = register_with(monkeypatch, Rare)
    words = rf"^environment 3 of 3: can't make {env_id}: ConnectionError: the port is taken"
    with pytest.raises(WorkbenchError, match=words):
        train(tmp_path, "reinforce", **MANY | {"env_id": env_id, "env_kwargs": None})


def test_each_has_a_robot_of_its_own(tmp_path: Path, monkeypatch) -> None:
    options = {"num_envs": 2, "episodes": 4, "policy_hidden": 0, "save_every": 0}
    alone, copied = register_with(monkeypatch, OnlyOne), register_with(monkeypatch, Copied)
    words = f"^{alone} moves a robot that there is only one of: num_envs must be 1, not 2$"
    with pytest.raises(WorkbenchError, match=words):
        train(tmp_path / "alone", "reinforce", env_id=alone, **options)
    run = train(tmp_path / "copied", "reinforce", env_id=copied, **options)
    assert summary(run)["episodes"] == 4
    assert runs.record(run)["run"]["env_kwargs"] == {}, "for whoever looks at its policy"


@pytest.mark.parametrize("name", ["dqn", "reinforce-document"])
def test_others_learn_in_one(name: str) -> None:
    words = f"^{name} learns in one environment: num_envs must be 1, not 2$"
    with pytest.raises(WorkbenchError, match=words):
        runs.small(name, num_envs=2)
