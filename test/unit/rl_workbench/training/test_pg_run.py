"""A whole training on a fake plant: what lies in the folder, and what happens when it fails."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from dqn_runs import InterruptAfter, points, rows, without_doubles
from learning_fakes import Dicing, FakePlant, OnlyOne, register_with
from pg_runs import CARTPOLE, checkpoint, resume, train
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.pg import keeper as pg_keeper
from rl_workbench.training.pg import run as pg_run
from rl_workbench.training.pg.policy import policy_of
from rl_workbench.training.pg.stage import gymnasium_stage
from rl_workbench.training.run import checkpoints as run_checkpoints
from rl_workbench.training.run import files as checkpoints
from rl_workbench.training.run.evaluation import Evaluation
from rl_workbench.training.run.interrupt import Interrupt

DOCUMENTS = {"Reward", "Value Loss", "Policy Loss"}
TAGS = DOCUMENTS | {
    "charts/episodic_return",
    "charts/episodic_length",
    "charts/SPS",
    "losses/policy_loss",
    "losses/value_loss",
    "eval/mean_reward",
}
NETWORKS = {"policy_network.pth", "value_network.pth"}
ALWAYS = NETWORKS | {"learning_curve.png", "summary.json", "config.json", "scalars.csv"}
SAVED = {"checkpoints", "last.pt"}


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if not path.name.startswith("events.out")}


def summary(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())


def test_a_training_leaves_networks_curve_summary_and_logs(tmp_path: Path, capsys) -> None:
    result = summary(train(tmp_path, episodes=6, save_every=5, seed=1))
    saved = {f"{kind}_network_episode_{n}.pth" for kind in ("policy", "value") for n in (0, 5)}
    assert files(tmp_path) == ALWAYS | saved | SAVED | {"best.pt"}
    assert result["episodes"] == len(result["lengths"]) == 6
    assert result["steps"] == sum(result["lengths"])
    assert result["failure"] is None and not result["interrupted"] and result["complete"]
    assert len(result["evaluation"]["lengths"]) == 20
    assert len(set(result["evaluation"]["lengths"])) > 1, "every episode starts somewhere else"
    told = capsys.readouterr().out
    assert "trained 6 episodes" in told and "greedy over 20" in told
    assert str(tmp_path) in told


def test_the_configuration_is_written_whole(tmp_path: Path) -> None:
    train(tmp_path, episodes=1, algorithm="gae", gamma=0.9, seed=4)
    record = json.loads((tmp_path / "config.json").read_text())
    assert record["algorithm"] == "pg"
    assert (record["run"]["algorithm"], record["run"]["seed"]) == ("gae", 4)
    assert (record["pg"]["gamma"], record["pg"]["value_epochs"]) == (0.9, 20)
    assert {"python", "torch", "command"} <= set(record["versions"])


def test_the_documents_constants_are_on_record(tmp_path: Path) -> None:
    train(tmp_path, episodes=1)
    record = json.loads((tmp_path / "config.json").read_text())
    assert record["pg"] == {
        "gamma": 0.99, "policy_learning_rate": 0.01, "value_learning_rate": 0.1
    }  # fmt: skip


def test_tags_by_episode_and_by_step(tmp_path: Path) -> None:
    result = summary(train(tmp_path, episodes=4))
    log = EventAccumulator(str(tmp_path))
    log.Reload()
    assert set(log.Tags()["scalars"]) == TAGS
    for tag in DOCUMENTS:
        assert [point.step for point in log.Scalars(tag)] == [0, 1, 2, 3]
    lengths = log.Scalars("charts/episodic_length")
    assert [point.value for point in lengths] == result["lengths"]
    ends = [sum(result["lengths"][: count + 1]) for count in range(4)]
    assert [point.step for point in lengths] == ends
    assert [point.step for point in log.Scalars("eval/mean_reward")] == ends[-1:]


def test_tensorboard_shows_what_the_csv_holds(tmp_path: Path) -> None:
    train(tmp_path, **CARTPOLE)
    without_doubles(tmp_path)
    losses = [row for row in rows(tmp_path) if row[1] == "losses/policy_loss"]
    assert len(losses) == 4, "one for each batch of three"
    assert len(points(tmp_path)["eval/mean_reward"]) == 4


def test_same_seed_same_files(tmp_path: Path) -> None:
    first, second = (train(tmp_path / name, episodes=5, seed=4) for name in "ab")
    weights = [
        torch.load(run / "policy_network.pth", weights_only=True)["fc.weight"]
        for run in (first, second)
    ]
    assert torch.equal(*weights)
    assert summary(first)["evaluation"] == summary(second)["evaluation"]


@pytest.mark.parametrize("algorithm", ["document", "gae"])
def test_evaluations_and_checkpoints_change_nothing_that_is_learned(
    tmp_path: Path, algorithm: str
) -> None:
    options = {"episodes": 8, "seed": 2, "algorithm": algorithm, "start_noise": 0.05}
    plain = train(tmp_path / "plain", **options, checkpoint_frequency=0)
    judged = train(tmp_path / "judged", **options, checkpoint_frequency=1, eval_frequency=3)
    mine, other = checkpoint(plain), checkpoint(judged)
    assert mine["agent"]["generator"] == other["agent"]["generator"]
    assert summary(plain)["lengths"] == summary(judged)["lengths"]
    assert [step for step, _ in summary(judged)["evaluations"]] == [
        sum(summary(plain)["lengths"][:count]) for count in (3, 6, 8)
    ]


@pytest.mark.parametrize("kind", [Dicing, OnlyOne])
def test_an_evaluation_leaves_the_generators_alone_that_it_shares(
    tmp_path: Path, monkeypatch, kind: type
) -> None:
    options = {"env_id": register_with(monkeypatch, kind), "episodes": 8, "eval_episodes": 2}
    plain = train(tmp_path / "plain", **options)
    judged = train(tmp_path / "judged", **options, eval_frequency=2)
    assert len(summary(judged)["evaluations"]) == 4
    assert summary(plain)["returns"] == summary(judged)["returns"]


def test_over_ros_the_one_robot_is_judged_too(monkeypatch) -> None:
    stage = gymnasium_stage(register_with(monkeypatch, OnlyOne), {})
    assert stage.judge is stage.env
    stage.close()


def test_start_noise_is_seeded(tmp_path: Path) -> None:
    lengths = [
        summary(train(tmp_path / name, episodes=5, seed=4, start_noise=noise))["lengths"]
        for name, noise in (("first", 0.05), ("again", 0.05), ("none", 0.0))
    ]
    assert lengths[0] == lengths[1] != lengths[2]


def test_the_best_is_that_of_the_best_evaluation(tmp_path: Path) -> None:
    result = summary(train(tmp_path, **CARTPOLE | {"confirm_episodes": 0}))
    steps, mean = max(result["evaluations"], key=lambda each: each[1])
    assert result["best"] == [steps, mean]
    assert checkpoint(tmp_path, "best.pt")["steps"] == steps


def test_a_worse_one_later_does_not_take_its_place(tmp_path: Path, monkeypatch) -> None:
    verdicts = [Evaluation([1], [value]) for value in (5.0, 9.0, 3.0, 9.0)]
    monkeypatch.setattr(pg_keeper, "run_greedily", lambda *_: verdicts.pop(0))
    result = summary(train(tmp_path, episodes=8, eval_frequency=2))
    assert [mean for _, mean in result["evaluations"]] == [5.0, 9.0, 3.0, 9.0]
    assert result["best"] == [sum(result["lengths"][:4]), 9.0]
    assert checkpoint(tmp_path, "best.pt")["steps"] == result["best"][0]


def test_a_policy_is_the_best_one_only_if_more_episodes_confirm_it(
    tmp_path: Path, monkeypatch
) -> None:
    def judged(env, act, seed: int, episodes: int, stop) -> Evaluation:
        asked.append((seed, episodes))
        return Evaluation([1], [verdicts.pop(0)])

    verdicts, asked = [5.0, 4.0, 9.0, 3.0, 3.5, 7.0, 6.0], []
    monkeypatch.setattr(pg_keeper, "run_greedily", judged)
    result = summary(
        train(tmp_path, episodes=8, eval_frequency=2, eval_episodes=3, confirm_episodes=6, seed=7)
    )
    assert [mean for _, mean in result["evaluations"]] == [5.0, 9.0, 3.5, 7.0]
    assert result["best"] == [result["steps"], 6.0]
    confirmed = [row[2] for row in rows(tmp_path) if row[1] == "eval/confirmed_reward"]
    assert confirmed == ["4.0", "6.0"]
    first, more = (7, 3), (1_000_007, 6)
    assert asked == [first, more, first, more, first, first, more]


def test_the_best_policy_comes_back_from_its_folder(tmp_path: Path) -> None:
    train(tmp_path, **CARTPOLE)
    policy = policy_of(run_checkpoints.read(tmp_path / "best.pt"), "best.pt", {})
    observation, _ = policy.env.reset(seed=0)
    assert policy.agent.probabilities(observation).sum() == pytest.approx(1.0)
    assert policy.choice.run.env_id == "CartPole-v1"
    policy.env.close()


def test_three_actions_and_two_observations(tmp_path: Path) -> None:
    options = {"env_id": "MountainCar-v0", "env_kwargs": {"max_episode_steps": 30}}
    train(tmp_path, **options, episodes=2, eval_episodes=1)
    assert checkpoint(tmp_path)["agent"]["policy"]["fc.weight"].shape == (3, 2)


def test_actions_that_do_not_suit(tmp_path: Path) -> None:
    with pytest.raises(
        WorkbenchError, match=r"REINFORCE needs .*Pendulum-v1 has Box.*PPO.* fit it"
    ):
        train(tmp_path, env_id="Pendulum-v1")
    assert files(tmp_path) == set()


def test_a_simulator_that_dies_costs_only_its_episode(tmp_path: Path) -> None:
    options = {"episodes": 30, "save_every": 0, "seed": 1, "checkpoint_frequency": 0}
    whole = train(tmp_path / "whole", **options)
    broken = tmp_path / "broken"
    with pytest.raises(WorkbenchError, match=r"has ended; stopped after \d+ of 30") as raised:
        train(broken, plant=FakePlant(fail_after=600), **options)
    assert str(broken) in str(raised.value) and "--resume" in str(raised.value)
    assert files(broken) == ALWAYS | SAVED
    result = summary(broken)
    assert result["failure"] and 0 < result["episodes"] < 30
    resume(broken)
    assert checkpoint(broken)["agent"]["generator"] == checkpoint(whole)["agent"]["generator"]
    assert summary(broken)["lengths"] == summary(whole)["lengths"]


def test_a_simulator_that_dies_in_the_first_episode(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="stopped after 0"):
        train(tmp_path, plant=FakePlant(fail_after=2))
    assert files(tmp_path) == (ALWAYS | SAVED) - {"learning_curve.png"}


def test_ctrl_c_saves_and_skips_the_evaluation(tmp_path: Path) -> None:
    interrupt = InterruptAfter(300)
    train(tmp_path, interrupt, episodes=1000, save_every=0)
    assert files(tmp_path) == ALWAYS | SAVED
    result = summary(tmp_path)
    assert result["interrupted"] and result["evaluation"] is None and not result["complete"]
    assert 0 < result["episodes"] < 300
    assert interrupt.exit_code == 130


def test_a_simulator_that_dies_of_the_same_ctrl_c_is_no_failure(tmp_path: Path) -> None:
    class Dying(FakePlant):
        def act(self, set_point: float):
            if self.actions == 50:
                interrupt.signal = 2
                raise WorkbenchError("the simulator has ended")
            return super().act(set_point)

    interrupt = Interrupt()
    train(tmp_path, interrupt, Dying())
    assert summary(tmp_path)["interrupted"]


def test_a_full_disk_is_one_line(tmp_path: Path, monkeypatch) -> None:
    def full(path: Path, write: Callable) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(checkpoints, "write_atomically", full)
    with pytest.raises(WorkbenchError, match="No space left on device") as raised:
        train(tmp_path, episodes=2, save_every=0)
    assert "is saved" not in str(raised.value) and "--resume" not in str(raised.value)


def test_a_disk_that_is_full_from_the_beginning_fails_before_tensorboard(tmp_path: Path) -> None:
    """TensorBoard writes in a thread of its own, which would end in a traceback."""
    (tmp_path / "scalars.csv").symlink_to("/dev/full")
    with pytest.raises(WorkbenchError, match="No space left on device; stopped after 0"):
        train(tmp_path, episodes=2)
    assert not list(tmp_path.glob("events.*"))


def test_ctrl_c_on_a_full_disk_tells_that_it_could_not_save(tmp_path: Path, monkeypatch) -> None:
    def full(path: Path, write: Callable) -> None:
        if interrupt.requested():
            raise OSError(28, "No space left on device", str(path))
        genuine(path, write)

    genuine, interrupt = checkpoints.write_atomically, InterruptAfter(300)
    monkeypatch.setattr(checkpoints, "write_atomically", full)
    with pytest.raises(WorkbenchError, match=r"No space left on device.*--resume") as raised:
        train(tmp_path, interrupt, episodes=1000, save_every=0)
    assert "is saved" not in str(raised.value)


def test_resuming_that_fails_at_once_costs_nothing(tmp_path: Path) -> None:
    class Dead(FakePlant):
        def reset(self, state):
            raise WorkbenchError("the simulator has ended")

    run = train(tmp_path / "run", InterruptAfter(800), episodes=100, save_every=0)
    before, weights = summary(run), torch.load(run / "policy_network.pth", weights_only=True)
    with pytest.raises(WorkbenchError, match=f"stopped after {before['episodes']} of 100"):
        resume(run, plant=Dead())
    assert summary(run)["returns"] == before["returns"] != []
    after = torch.load(run / "policy_network.pth", weights_only=True)
    assert torch.equal(after["fc.weight"], weights["fc.weight"])


def test_a_disk_that_fills_up_keeps_the_checkpoint_before(tmp_path: Path, monkeypatch) -> None:
    options = {"episodes": 9, "checkpoint_frequency": 3, "save_every": 0}

    def full(path: Path, write: Callable) -> None:
        if len(list(path.parent.glob("step_*.pt"))) == 3:
            raise OSError(28, "No space left on device", str(path))
        genuine(path, write)

    genuine = checkpoints.write_atomically
    whole = train(tmp_path / "whole", **options)
    with monkeypatch.context() as disk:
        disk.setattr(checkpoints, "write_atomically", full)
        with pytest.raises(WorkbenchError, match="No space left on device"):
            train(tmp_path / "run", **options)
    assert len(checkpoint(tmp_path / "run")["history"]["lengths"]) == 6
    resume(tmp_path / "run")
    assert rows(tmp_path / "run") == rows(whole)


@pytest.mark.parametrize("algorithm", ["document", "gae"])
def test_a_loss_that_is_no_number_is_one_line_and_loses_nothing(
    tmp_path: Path, algorithm: str
) -> None:
    class Spoilt(FakePlant):
        def act(self, set_point: float):
            state = super().act(set_point)
            return state._replace(cart_velocity=float("nan")) if self.actions > 300 else state

    with pytest.raises(WorkbenchError, match=r"loss is nan.*--resume"):
        train(tmp_path, plant=Spoilt(), algorithm=algorithm, checkpoint_frequency=0)
    content = checkpoint(tmp_path)
    assert len(content["history"]["lengths"]) == summary(tmp_path)["episodes"] > 0
    assert all(weight.isfinite().all() for weight in content["agent"]["policy"].values())


def test_an_observation_that_is_no_number_in_an_evaluation(tmp_path: Path) -> None:
    class Spoilt(FakePlant):
        def reset(self, state):
            self.is_judged = state.pole_angle != 0.0  # the training's own begin upright
            return super().reset(state)

        def act(self, set_point: float):
            state = super().act(set_point)
            return state._replace(cart_position=float("nan")) if self.is_judged else state

    with pytest.raises(WorkbenchError, match=r"observation .* isn't finite.*is saved in.*--resume"):
        train(tmp_path, plant=Spoilt(), episodes=3)
    assert summary(tmp_path)["episodes"] == 3 and not (tmp_path / "best.pt").exists()


def test_the_mean_of_the_last_episodes(tmp_path: Path) -> None:
    result = summary(train(tmp_path, episodes=70, save_every=0))
    assert result[f"mean_length_last_{pg_run.LAST}"] == pytest.approx(
        sum(result["lengths"][-60:]) / 60
    )
