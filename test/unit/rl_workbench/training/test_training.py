"""The frame of all trainings: what one leaves behind, how long it lasts, and what it depends on."""

import csv
from pathlib import Path

import pytest
from support.training import training_runs as runs
from support.training.training_runs import ALL, EXACT, checkpoint, points, rows, summary, train
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams import plugin_data_pb2

from rl_workbench.errors import WorkbenchError

FILES = {"last.pt", "best.pt", "checkpoints", "config.json", "scalars.csv", "summary.json",
         "learning_curve.png"}  # fmt: skip
TIMES = ("", "_episode_0", "_episode_5", "_episode_10")
NETWORKS = {f"{kind}_network{time}.pth" for kind in ("policy", "value") for time in TIMES}
OWN_FILES = {"dqn": set(), "ppo": {"model.zip"}, "sac": {"model.zip"}}
TAGS = {"charts/episodic_return", "charts/episodic_length", "charts/SPS", "eval/mean_reward",
        "eval/confirmed_reward"}  # fmt: skip
BY_EPISODE = {"Reward", "Value Loss", "Policy Loss"}
OWN_TAGS = {
    "dqn": {"charts/epsilon", "losses/td_loss", "losses/q_values"},
    "ppo": {"losses/loss", "losses/value_loss", "losses/policy_loss"},
    "sac": {"losses/actor_loss", "losses/critic_loss"},
}
OF_REINFORCE = BY_EPISODE | {"losses/value_loss", "losses/policy_loss"}


@pytest.mark.parametrize("name", ALL)
def test_a_training_leaves_its_files(whole, name: str) -> None:
    assert runs.files(whole(name)) == FILES | OWN_FILES.get(name, NETWORKS)


@pytest.mark.parametrize("name", ALL)
def test_the_summary_tells_it_all(whole, name: str) -> None:
    result, run = summary(whole(name)), runs.small(name).run
    assert result["complete"] and not result["interrupted"] and result["failure"] is None
    assert result["episodes"] == len(result["returns"]) == len(result["lengths"]) > 0
    assert result["steps"] == (run.total_timesteps or sum(result["lengths"]))
    assert sum(result["lengths"]) <= result["steps"]
    assert run.episodes in (0, result["episodes"])
    assert len(result["evaluation"]["lengths"]) == run.eval_episodes
    assert result["seconds"] > 0
    assert result["mean_length_last_20"] == pytest.approx(
        sum(result["lengths"][-20:]) / len(result["lengths"][-20:])
    )
    mean = sum(result["returns"]) / result["episodes"]
    assert result["mean_return_last_100"] == pytest.approx(mean)


@pytest.mark.parametrize("name", ALL)
def test_tensorboard_shows_what_the_csv_holds(whole, name: str) -> None:
    run, result = whole(name), summary(whole(name))
    assert set(points(run)) == TAGS | OWN_TAGS.get(name, OF_REINFORCE)
    runs.assert_no_doubles(run)
    by_tag: dict[str, list[float]] = {}
    with (run / "scalars.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            by_tag.setdefault(row["tag"], []).append(float(row["value"]))
    assert by_tag["charts/episodic_return"] == result["returns"]
    assert by_tag["charts/episodic_length"] == result["lengths"]
    for tag, values in points(run).items():
        if tag != "charts/SPS":
            assert [value for _, value in values] == pytest.approx(by_tag[tag], rel=1e-6)
    shown = points(run)["eval/mean_reward"]
    assert [step for step, _ in shown] == [step for step, _ in result["evaluations"]]


@pytest.mark.parametrize("name", EXACT)
def test_hyper_parameters_stand_beside_the_result(whole, name: str) -> None:
    log = EventAccumulator(str(whole(name)))
    log.Reload()
    content = log.PluginTagToContent("hparams")
    read = plugin_data_pb2.HParamsPluginData.FromString
    start = read(content["_hparams_/session_start_info"]).session_start_info
    assert start.hparams["gamma"].number_value == 0.99
    assert start.hparams["env_id"].string_value == runs.small(name).run.env_id
    if name == "dqn":
        assert start.hparams["double"].string_value == "True", "not the number 1"
    experiment = read(content["_hparams_/experiment"]).experiment
    metrics = {each.name.tag for each in experiment.metric_infos}
    assert metrics == {"eval/mean_reward", "charts/episodic_return"}
    assert "hp_metric" not in points(whole(name))


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_the_same_seed_gives_the_same_bits_and_another_one_others(whole, tmp_path, name) -> None:
    runs.assert_same_run(whole(name), train(tmp_path / "again", name))
    assert rows(train(tmp_path / "other", name, seed=4)) != rows(whole(name))


@pytest.mark.slow
@pytest.mark.parametrize("name", ALL)
def test_evaluations_and_checkpoints_change_nothing_that_is_learned(whole, tmp_path, name) -> None:
    """Without a frequency it is evaluated at the end alone."""
    none = {"eval_frequency": 0, "checkpoint_frequency": 0, "eval_episodes": 5}
    plain, evaluated = train(tmp_path, name, **none), whole(name)
    result = summary(plain)
    assert len(summary(evaluated)["evaluations"]) >= 2
    assert result["returns"] == summary(evaluated)["returns"]
    assert [step for step, _ in result["evaluations"]] == [result["steps"]]
    assert checkpoint(plain, "best.pt")["steps"] == result["steps"]
    assert len(set(result["evaluation"]["returns"])) > 1, "every episode starts somewhere else"
    mine, other = checkpoint(plain), checkpoint(evaluated)
    for content in (mine, other):
        del content["config"], content["history"]
        content.pop("best_at_the_end", None)
    runs.assert_same(mine, other)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXACT)
def test_a_number_of_episodes_or_of_steps(tmp_path: Path, name: str) -> None:
    few = train(tmp_path / "few", name, episodes=4)
    assert summary(few)["episodes"] == 4 and summary(few)["complete"]
    short = summary(train(tmp_path / "short", name, total_timesteps=50))
    assert short["complete"] and short["steps"] >= 50
    assert short["steps"] == 50 if name == "dqn" else sum(short["lengths"][:-1]) < 50


@pytest.mark.parametrize("name", EXACT)
def test_a_mean_return_ends_it_once_it_is_confirmed(tmp_path: Path, name: str) -> None:
    result = summary(train(tmp_path, name, stop_at_return=-1000))
    assert result["complete"] and [result["steps"], result["best"][1]] == result["best"]
    assert len(result["evaluations"]) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", EXACT)
def test_the_mean_length_of_20_episodes_ends_it(tmp_path: Path, name: str) -> None:
    free = {"total_timesteps": None, "episodes": 35, "eval_frequency": 0}
    lengths = summary(train(tmp_path / "whole", name, **free))["lengths"]
    means = [sum(lengths[end - 20 : end]) / 20 for end in range(20, 36)]
    result = summary(train(tmp_path / "stopped", name, **free, stop_at_length=max(means)))
    assert result["complete"]
    assert 20 < result["episodes"] == 20 + means.index(max(means)), "not the first ones that came"
    assert result["lengths"] == lengths[: result["episodes"]]
    few = train(tmp_path / "few", name, **free, stop_at_length=1)
    assert summary(few)["episodes"] == 20, "no fewer"


@pytest.mark.extras("stable_baselines3")
def test_stable_baselines_needs_a_number_of_steps(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="ppo needs total_timesteps"):
        train(tmp_path, "ppo", total_timesteps=0, episodes=4)
    stopped = summary(train(tmp_path / "run", "ppo", episodes=4))
    assert stopped["episodes"] >= 4 and stopped["steps"] % 64 == 0, "it ends with a rollout"
    assert stopped["complete"] and stopped["steps"] < 256
