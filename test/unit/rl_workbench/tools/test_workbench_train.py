"""`workbench.py train`: one command line for all algorithms; what Stable-Baselines3's runs keep."""

import json
import os
import signal
from pathlib import Path

import dqn_runs
import gymnasium
import numpy as np
import pytest
import torch
import workbench_runs

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError

pytestmark = [pytest.mark.usefixtures("signals"), pytest.mark.extras("stable_baselines3")]
PPO = ["train", "--algo", "ppo", "--env-id", "CartPole-v1", "--n-steps", "64", "--net-arch", "8"]
SAC = {"env_id": "Pendulum-v1", "total_timesteps": 260, "learning_starts": 50, "buffer_size": 100,
       "batch_size": 8, "net_arch": "8", "eval_frequency": 0, "checkpoint_frequency": 50,
       "n_steps": None}  # fmt: skip


@pytest.fixture
def ppo(tmp_path: Path) -> Path:
    return workbench_runs.sb3(tmp_path / "run", net_arch="8")


def work(*arguments: object) -> int:
    return cli.main([str(each) for each in arguments])


def summary(run: Path) -> dict:
    return json.loads((run / "summary.json").read_text())


def test_our_dqn_has_the_flags_of_its_own_command(tmp_path: Path) -> None:
    run = tmp_path / "run"
    flags = dqn_runs.flags({**dqn_runs.SMALL, "run_dir": run})
    assert work("train", "--algo", "dqn", *flags) == 0
    assert summary(run)["steps"] == 600
    assert work("train", "--resume", run, "--total-timesteps", 700) == 0
    assert summary(run)["steps"] == 700


@pytest.mark.parametrize(("name", "flag"), [("dqn", "--dueling"), ("pg", "--stop-at"),
                                            ("ppo", "--clip-range"), ("sac", "--ent-coef")])  # fmt: skip
def test_every_algorithm_shows_its_own_flags(name: str, flag: str, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        work("train", "--algo", name, "--help")
    assert ended.value.code == 0
    assert flag in capsys.readouterr().out


def test_the_help_of_train_names_all_algorithms(capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        work("train", "--help")
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert "dqn, pg, ppo, a2c, sac, td3, ddpg, dqn-sb3" in told and "--algo NAME --help" in told


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ([], "--algo is missing, one of dqn, pg, ppo"),
        (["--algo", "qpo"], "unknown algorithm 'qpo'; did you mean ppo?"),
        (["--algo", "ppo", "--learning-rat", "1"], "did you mean --learning-rate?"),
        (["--algo", "dqn", "--gama", "1"], "--gama"),
    ],
)
def test_wrong_words_of_train(flags: list[str], told: str, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        work("train", *flags)
    assert ended.value.code == 2
    assert told in capsys.readouterr().err


def test_options_are_flags_and_a_small_number_may_be_written_as_people_do(tmp_path: Path) -> None:
    run = tmp_path / "run"
    flags = ["--learning-rate", "1e-3", "--use-sde", "--no-normalize-advantage", "--n-epochs", "2",
             "--params", "gamma=9e-1"]  # fmt: skip
    code = work("train", "--algo", "ppo", "--env-id", "Pendulum-v1", "--n-steps", "64", "--run-dir",
                run, "--total-timesteps", "64", "--eval-frequency", "0", *flags)  # fmt: skip
    assert code == 0
    own = json.loads((run / "config.json").read_text())["sb3"]
    assert (own["learning_rate"], own["gamma"], own["n_epochs"]) == (1e-3, 0.9, 2)
    assert own["use_sde"] and not own["normalize_advantage"]
    assert (own["gae_lambda"], own["clip_range"]) == (0.95, 0.2), "what nobody gave is there, too"


def test_a_linear_rate_falls_from_the_algorithms_own(tmp_path: Path) -> None:
    from rl_workbench.training.sb3.model import make_model
    from rl_workbench.training.sb3.settings import choose

    model = make_model(choose("a2c", ["--env-id", "CartPole-v1", "--lr-schedule", "linear"]))
    assert model.lr_schedule(1.0) == pytest.approx(7e-4) and model.lr_schedule(0.0) == 0.0
    model.get_env().close()


def test_how_often_it_learns_may_be_told_in_episodes(tmp_path: Path) -> None:
    run = workbench_runs.sb3(tmp_path / "run", "sac", **SAC, train_freq="[1, episode]")
    assert summary(run)["complete"] and work("eval", run, "--episodes", 1) == 0


def test_the_record_says_with_which_versions_and_command(ppo: Path) -> None:
    versions = json.loads((ppo / "config.json").read_text())["versions"]
    assert {"stable_baselines3", "gymnasium", "torch", "command"} <= set(versions)


def test_checkpoints_every_n_steps_and_the_newest_are_kept(tmp_path: Path) -> None:
    run = workbench_runs.sb3(tmp_path / "run", "sac", **SAC, keep_checkpoints=2)
    names = sorted(path.name for path in (run / "checkpoints").iterdir())
    assert names == ["step_000000250.pt", "step_000000260.pt"]


# --resume


def test_a_resumed_training_goes_on_with_figures_and_networks(ppo: Path) -> None:
    before, weights = summary(ppo), torch.load(ppo / "last.pt", weights_only=True)
    assert work("train", "--resume", ppo, "--total-timesteps", 512) == 0
    after = summary(ppo)
    assert after["steps"] == 512 and after["complete"]
    assert after["returns"][: len(before["returns"])] == before["returns"]
    assert [step for step, _ in after["evaluations"]] == [128, 256, 384, 512]
    dqn_runs.without_doubles(ppo)
    state = torch.load(ppo / "last.pt", weights_only=True)
    optimizer = state["optimizers"]["policy.optimizer"]["state"][0]["step"]
    assert optimizer == 2 * weights["optimizers"]["policy.optimizer"]["state"][0]["step"]
    assert json.loads((ppo / "config.json").read_text())["run"]["total_timesteps"] == 512


def test_what_is_not_the_same_is_said(ppo: Path, capsys) -> None:
    work("train", "--resume", ppo, "--total-timesteps", 320)
    assert "with a new episode and other random numbers" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        work("train", "--algo", "ppo", "--help")
    assert "so not to the same bits" in " ".join(capsys.readouterr().out.split())


def test_the_state_comes_back_whole(tmp_path: Path) -> None:
    from rl_workbench.training.sb3.model import make_model
    from rl_workbench.training.sb3.settings import choose
    from rl_workbench.training.sb3.state import restore, state_of

    run = workbench_runs.sb3(tmp_path / "run", "sac", **SAC)
    saved = torch.load(run / "last.pt", weights_only=True)
    model = make_model(choose("sac", ["--resume", str(run)]))
    restore(model, saved, 7)
    again = state_of(model)
    assert saved["buffer"]["full"] and saved["entropy"] is not None
    for name in again:
        dqn_runs.assert_same(dict(saved[name]) if isinstance(saved[name], dict) else saved[name],
                             dict(again[name]) if isinstance(again[name], dict) else again[name])  # fmt: skip
    model.get_env().close()


def test_a_resumed_one_explores_other_episodes(tmp_path: Path) -> None:
    run = workbench_runs.sb3(tmp_path / "run", "sac", **SAC)
    begun = torch.load(run / "last.pt", weights_only=True)["buffer"]["arrays"]["observations"]
    first = gymnasium.make("Pendulum-v1").reset(seed=0)[0]
    assert work("train", "--resume", run, "--total-timesteps", 300) == 0
    seen = torch.load(run / "last.pt", weights_only=True)["buffer"]["arrays"]["observations"]
    assert len(begun) == len(seen) == 100
    assert not (np.isclose(seen.numpy().reshape(100, -1), first).all(axis=1)).any()


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--seed", "1"], "--resume allows no --seed, only --total-timesteps and --device"),
        (["--gamma", "0.9"], "--resume allows no --gamma"),
        (["--algo", "sac"], "was trained by ppo, not by sac"),
    ],
)
def test_what_cannot_be_changed_when_resuming(
    ppo: Path, flags: list[str], told: str, capsys
) -> None:
    assert work("train", "--resume", ppo, *flags) == 1
    assert told in capsys.readouterr().err


def test_nothing_to_go_on_from(ppo: Path, tmp_path: Path, capsys) -> None:
    assert work("train", "--resume", tmp_path / "nowhere") == 1
    assert "there is no such folder" in capsys.readouterr().err
    for path in ppo.rglob("*.pt"):
        path.unlink()
    assert work("train", "--resume", ppo) == 1
    assert "no checkpoint to go on from" in capsys.readouterr().err


def test_a_checkpoint_that_holds_the_policy_alone(ppo: Path, capsys) -> None:
    for path in ppo.rglob("*.pt"):
        content = torch.load(path, weights_only=True)
        content.pop("optimizers", None)
        torch.save(content, path)
    assert work("train", "--resume", ppo) == 1
    assert "the checkpoint can't be gone on from" in capsys.readouterr().err


# What goes wrong on the way: one line, and nothing lost.


def test_a_rate_that_blows_up(tmp_path: Path, capsys) -> None:
    run = tmp_path / "run"
    flags = ["--learning-rate", "1e30", "--total-timesteps", "640", "--eval-frequency", "64"]
    assert work(*PPO, *flags, "--run-dir", run) == 1
    line = capsys.readouterr().err.splitlines()[-1]
    assert "no numbers any more: a smaller learning_rate may help" in line
    assert "goes on from the last checkpoint" in line
    assert summary(run)["failure"] and not summary(run)["complete"]
    weights = torch.load(run / "last.pt", weights_only=True)["policy"]
    assert all(torch.isfinite(each).all() for each in weights.values())


def test_a_rate_that_torch_refuses(tmp_path: Path, capsys) -> None:
    run = tmp_path / "run"
    code = work("train", "--algo", "dqn-sb3", "--env-id", "CartPole-v1", "--learning-rate", "1e38",
                "--learning-starts", 10, "--buffer-size", 50, "--run-dir", run)  # fmt: skip
    assert code == 1
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("workbench.py: dqn-sb3 failed: ") and "goes on" not in line
    assert summary(run)["failure"]


def test_a_loss_that_is_none(tmp_path: Path) -> None:
    from rl_workbench.training.sb3.callback import check_finite

    for value in (float("nan"), float("inf")):
        with pytest.raises(WorkbenchError, match="losses/value_loss is .*learning_rate"):
            check_finite("losses/value_loss", value)


def test_a_full_disk(tmp_path: Path, monkeypatch, capsys) -> None:
    run, real = tmp_path / "run", os.fsync
    calls = []

    def full(descriptor: int) -> None:
        calls.append(descriptor)
        if (run / "last.pt").exists():
            raise OSError(28, "No space left on device")
        real(descriptor)

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        assert (
            work(*PPO, "--total-timesteps", "320", "--eval-frequency", "64", "--run-dir", run) == 1
        )
    assert "No space left on device; stopped after 128 steps" in capsys.readouterr().err
    assert work("train", "--resume", run) == 0, "with space again it goes on"
    assert summary(run)["steps"] == 320


def test_ctrl_c_saves_what_was_learned_and_it_can_be_gone_on_with(
    tmp_path: Path, monkeypatch, capsys
) -> None:
    from rl_workbench.training.sb3.callback import Follower

    def press(self, total: float, length: int) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    run = tmp_path / "run"
    with monkeypatch.context() as patched:
        patched.setattr(Follower, "_episode_done", press)
        assert work(*PPO, "--total-timesteps", "320", "--run-dir", run) == 130
    assert summary(run)["interrupted"] and 0 < summary(run)["steps"] < 320
    assert f"train --resume {run} goes on" in capsys.readouterr().out
    assert work("train", "--resume", run) == 0
    assert summary(run)["complete"]


def test_a_bar_on_a_terminal(tmp_path: Path) -> None:
    from io import StringIO

    from rl_workbench.training.run.history import History
    from rl_workbench.training.sb3.progress import SB3Progress

    class Terminal(StringIO):
        def isatty(self) -> bool:
            return True

    history, terminal = History(returns=[1.5] * 20), Terminal()
    shown = SB3Progress(200, 0, history, terminal)
    shown.show(1.5, 99.0)
    shown.close()
    told = terminal.getvalue()
    assert (
        "/200" in told
        and "Episode   20 | Reward:     1.50 | Avg(20):     1.50 | 99 steps/s" in told
    )


def test_many_environments_of_training_are_one_when_playing(tmp_path: Path, recwarn) -> None:
    run = workbench_runs.sb3(tmp_path / "run", n_envs=8, n_steps=1, batch_size=8)
    assert work("eval", run, "--episodes", 1) == 0
    assert not [each for each in recwarn if "mini-batch" in str(each.message)]
