"""Whole trainings in this process: what they leave, and that resuming changes nothing."""

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
from dqn_runs import (
    InterruptAfter,
    assert_same,
    assert_same_run,
    checkpoint,
    points,
    resume,
    rows,
    small,
    summary,
    train,
    without_doubles,
)

from rl_workbench.agents.dqn.agent import DQNAgent
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.dqn.run import DQNTraining
from rl_workbench.training.dqn.settings import choose
from rl_workbench.training.run import checkpoints as run_checkpoints
from rl_workbench.training.run import folder as run_folder

TAGS = {
    "charts/episodic_return",
    "charts/episodic_length",
    "charts/SPS",
    "charts/epsilon",
    "losses/td_loss",
    "losses/q_values",
    "eval/mean_reward",
    "eval/confirmed_reward",
}
FILES = {"last.pt", "best.pt", "checkpoints", "config.json", "scalars.csv", "summary.json",
         "learning_curve.png"}  # fmt: skip


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A training that was never interrupted."""
    return train(tmp_path_factory.mktemp("whole"))


def test_a_training_leaves_its_files(whole: Path) -> None:
    names = {path.name for path in whole.iterdir()}
    assert {name for name in names if not name.startswith("events.out")} == FILES
    result = summary(whole)
    assert result["steps"] == 600 and result["complete"] and result["failure"] is None
    assert sum(result["lengths"]) <= 600
    assert len(result["evaluations"]) == 4
    steps = [path.name for path in sorted((whole / "checkpoints").iterdir())]
    assert steps == ["step_000000490.pt", "step_000000560.pt", "step_000000600.pt"]


def test_the_configuration_is_written_whole(whole: Path) -> None:
    config = json.loads((whole / "config.json").read_text())
    assert config["dqn"]["n_step"] == 3 and config["run"]["env_id"] == "CartPole-v1"
    assert config["versions"]["torch"] and "command" in config["versions"]
    assert checkpoint(whole)["config"]["dqn"]["hidden_sizes"] == (16, 16)


def test_tags_and_csv_hold_the_same_rows(whole: Path) -> None:
    assert set(points(whole)) == TAGS
    without_doubles(whole)
    returns = [float(value) for _, tag, value in rows(whole) if tag == "charts/episodic_return"]
    assert returns == summary(whole)["returns"]


def test_a_checkpoint_has_the_documents_keys_and_loads_safely(whole: Path) -> None:
    content = checkpoint(whole)
    assert {"q_net", "target_net", "epsilon", "optimizer", "replay"} <= set(content)
    assert "net.0.weight" in content["q_net"], "the document's QNetwork loads it"
    assert content["q_net"]["net.0.weight"].untyped_storage().nbytes() == 16 * 4 * 4


def test_the_same_seed_gives_the_same_bits(whole: Path, tmp_path: Path) -> None:
    assert_same_run(whole, train(tmp_path / "again"))


def test_another_seed_gives_others(whole: Path, tmp_path: Path) -> None:
    assert rows(train(tmp_path / "other", seed=1)) != rows(whole)


@pytest.mark.parametrize("asked", [1, 2, 3, 71, 137, 150, 151, 301, 500])
def test_ctrl_c_anywhere_and_resumed_is_the_same_training(
    whole: Path, tmp_path: Path, asked: int
) -> None:
    interrupt = InterruptAfter(asked)
    run = train(tmp_path / "run", interrupt)
    assert interrupt.exit_code == 130
    assert summary(run)["interrupted"] and not summary(run)["complete"]
    assert_same_run(whole, resume(run))
    without_doubles(run)


def test_interrupted_again_and_again(whole: Path, tmp_path: Path) -> None:
    run = train(tmp_path / "run", InterruptAfter(40))
    for asked in (30, 2, 90, 160):
        resume(run, InterruptAfter(asked))
    assert_same_run(whole, resume(run))


def test_resuming_a_complete_training_changes_nothing(whole: Path, tmp_path: Path) -> None:
    run = train(tmp_path / "run")
    assert_same_run(whole, resume(run))


def test_a_complete_training_can_be_prolonged(tmp_path: Path) -> None:
    run = train(tmp_path / "run", lr_schedule="constant", total_timesteps=300)
    choice = choose(["--resume", str(run), "--total-timesteps=450"], {})
    DQNTraining(choice, run, InterruptAfter(40)).run()
    assert summary(run)["steps"] < 450
    began = json.loads((run / "config.json").read_text())["began"]
    assert summary(resume(run))["steps"] == 450, "it remembers its new length"
    assert json.loads((run / "config.json").read_text())["began"] == began
    without_doubles(run)


def test_a_damaged_checkpoint_is_told_and_the_one_before_is_used(
    whole: Path, tmp_path: Path, capsys
) -> None:
    run = train(tmp_path / "run", InterruptAfter(450))
    newest = (run / "last.pt").resolve()
    content = bytearray(newest.read_bytes())
    content[len(content) // 2] ^= 1  # in the middle of some tensor: torch alone would not see it
    newest.write_bytes(content)
    resumed = resume(run)
    told = capsys.readouterr().out
    assert f"{run / 'last.pt'} is damaged" in told and "looking for an earlier one" in told
    assert_same_run(whole, resumed)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 half a zip", b"\x80\x04 a pickle", b"text"])
def test_foreign_files_are_told_from_checkpoints(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "last.pt"
    path.write_bytes(content)
    with pytest.raises(WorkbenchError, match="damaged, or no checkpoint"):
        run_checkpoints.read(path)


def test_somebody_elses_torch_file_is_told_from_a_checkpoint(tmp_path: Path) -> None:
    torch.save({"q_net": {}}, tmp_path / "last.pt")
    with pytest.raises(WorkbenchError, match="no checkpoint of this version"):
        run_checkpoints.read(tmp_path / "last.pt")


def test_without_any_good_checkpoint_resuming_is_refused(tmp_path: Path) -> None:
    run = train(tmp_path / "run", InterruptAfter(40))
    for path in (run / "checkpoints").iterdir():
        path.write_bytes(b"")
    with pytest.raises(WorkbenchError, match="holds no checkpoint"):
        resume(run)


def test_no_run_folder_to_resume(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="is no run folder"):
        choose(["--resume", str(tmp_path)], {})


def test_a_full_disk_is_one_line_and_keeps_the_checkpoint_before(
    whole: Path, tmp_path: Path, monkeypatch
) -> None:
    run = tmp_path / "run"
    real, writes = run_checkpoints.save_tensors, []

    def full(path: Path, content: dict) -> None:
        writes.append(path)
        if len(writes) > 4:
            raise OSError(28, "No space left on device", str(path))
        real(path, content)

    monkeypatch.setattr(run_checkpoints, "save_tensors", full)
    with pytest.raises(WorkbenchError, match=r"can't write .*No space left.*--resume") as raised:
        train(run)
    assert "\n" not in str(raised.value)
    monkeypatch.undo()
    assert_same_run(whole, resume(run))


def test_a_loss_that_is_no_number_ends_the_training(tmp_path: Path, monkeypatch) -> None:
    step = gymnasium.envs.classic_control.CartPoleEnv.step

    def spoilt(env, action):
        observation, reward, *rest = step(env, action)
        return observation, reward * 1e38, *rest

    monkeypatch.setattr(gymnasium.envs.classic_control.CartPoleEnv, "step", spoilt)
    with pytest.raises(WorkbenchError, match=r"the loss is .*inf.*smaller learning_rate.*--resume"):
        train(tmp_path / "run", loss="mse", eval_frequency=0)
    content = checkpoint(tmp_path / "run", "failure.pt")
    assert all(tensor.isfinite().all() for tensor in content["q_net"].values())


class Broken(gymnasium.Env):
    """Dies after some steps."""

    observation_space = gymnasium.spaces.Box(-1, 1, (2,), np.float32)
    action_space = gymnasium.spaces.Discrete(3)

    def __init__(self) -> None:
        self.steps = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.np_random.uniform(-1, 1, 2).astype(np.float32), {}

    def step(self, action):
        self.steps += 1
        if self.steps > 100:
            raise WorkbenchError("the simulator has ended")
        return self.np_random.uniform(-1, 1, 2).astype(np.float32), 1.0, False, False, {}


@pytest.fixture
def broken(monkeypatch) -> str:
    monkeypatch.setitem(
        gymnasium.registry,
        "Broken-v0",
        gymnasium.envs.registration.EnvSpec("Broken-v0", Broken, disable_env_checker=True),
    )
    return "Broken-v0"


def test_an_environment_that_dies_costs_nothing_that_was_saved(broken: str, tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="has ended; stopped after 100 of 600"):
        train(tmp_path / "run", env_id=broken, eval_frequency=0)
    assert summary(tmp_path / "run")["failure"]
    assert checkpoint(tmp_path / "run")["steps"] == 70


def test_an_environment_that_goes_another_way_costs_its_episode(
    tmp_path: Path, monkeypatch, capsys
) -> None:
    run = train(tmp_path / "run", InterruptAfter(90))
    content = run_checkpoints.read(run / "last.pt")
    content["loop"]["tape"]["observation"] += 1
    torch.save(content, run / "last.pt")
    resume(run)
    assert "the episode under way is given up" in capsys.readouterr().err
    assert summary(run)["complete"]


def test_episodes_and_a_return_to_stop_at(tmp_path: Path) -> None:
    assert summary(train(tmp_path / "a", episodes=7))["episodes"] == 7
    result = summary(train(tmp_path / "b", stop_at_return=5))
    assert result["steps"] == 150 and result["complete"]


def test_a_folder_in_use_is_refused(tmp_path: Path) -> None:
    second = run_folder.held(tmp_path)
    with run_folder.held(tmp_path), pytest.raises(WorkbenchError, match="is running in"), second:
        pass


def test_the_robot_in_process_resumes_exactly(tmp_path: Path) -> None:
    options = {"env_id": "cartpole/Classic-v0", "eval_frequency": 0, "total_timesteps": 300}
    first = train(tmp_path / "first", **options)
    second = train(tmp_path / "second", InterruptAfter(137), **options)
    resume(second)
    assert rows(first) == rows(second)
    assert_same(checkpoint(first)["q_net"], checkpoint(second)["q_net"])


def test_a_policy_moves_to_another_agent(whole: Path) -> None:
    agent = DQNAgent(small().dqn, 4, 2)
    agent.load_policy_state(checkpoint(whole, "best.pt"))
    observation = np.ones(4, np.float32)
    assert agent.act_greedily(observation) == int(agent.q_values(observation[None]).argmax())
