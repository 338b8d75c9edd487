"""What is Stable-Baselines3's own in a training: what is saved, gone on with, and goes wrong."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from support.training import training_runs as runs
from support.training.learning_fakes import POLE, Elsewhere, register_with
from support.training.training_runs import assert_same, checkpoint, options_of, summary, train

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithm import load_policy
from rl_workbench.training.environments import make_environment
from rl_workbench.training.options import recorded_options

pytestmark = pytest.mark.extras("stable_baselines3")

OFF_POLICY = {"total_timesteps": 200, "learning_starts": 50, "buffer_size": 500, "batch_size": 16,
              "eval_frequency": 100, "eval_episodes": 1, "net_arch": "8"}  # fmt: skip
CONTINUOUS = {"env_id": "Pendulum-v1", "env_kwargs": {"max_episode_steps": 20}}


def weights(path: Path) -> dict[str, torch.Tensor]:
    return torch.load(path, weights_only=True)["policy"]


@pytest.mark.parametrize(
    ("algorithm", "options"),
    [("td3", OFF_POLICY | CONTINUOUS), ("ddpg", OFF_POLICY | CONTINUOUS), ("dqn-sb3", OFF_POLICY),
     ("a2c", {"total_timesteps": 200, "n_steps": 16, "eval_frequency": 100}),
     ("ppo", {"total_timesteps": 200, "n_steps": 50, "batch_size": 100, "num_envs": 2,
              "eval_frequency": 100})],
)  # fmt: skip
def test_each_trains_and_its_policy_is_the_librarys(tmp_path, algorithm: str, options) -> None:
    import stable_baselines3

    folder = runs.run(options_of(algorithm, options), tmp_path)
    result = summary(folder)
    assert result["complete"] and result["steps"] >= 200 and result["episodes"] > 0
    evaluated = [step for step, _ in result["evaluations"]][:2]
    assert evaluated == ([112, 208] if algorithm == "a2c" else [100, 200]), "after a rollout"
    content = torch.load(folder / "last.pt", weights_only=True)
    chosen = recorded_options(content["config"], "here")
    env = make_environment(chosen.run.env_id)
    policy = load_policy(chosen, content, env, "here")
    name = {"dqn-sb3": "DQN"}.get(algorithm, algorithm.upper())
    model = getattr(stable_baselines3, name).load(folder / "model.zip")
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        wanted = model.predict(observation, deterministic=True)[0]
        assert np.array_equal(policy.act(observation), wanted)
    env.close()


def test_checkpoints_every_so_many_steps_and_the_newest_are_kept(tmp_path: Path) -> None:
    train(tmp_path, "sac", keep_checkpoints=2, eval_frequency=0)
    names = sorted(path.name for path in (tmp_path / "checkpoints").iterdir())
    assert names == ["step_000000120.pt", "step_000000140.pt"]


def test_of_several_environments_the_step_that_passes_a_multiple_counts(tmp_path: Path) -> None:
    options = {"num_envs": 3, "n_steps": 20, "batch_size": 60, "keep_checkpoints": 0}
    train(tmp_path, "ppo", **options, eval_frequency=0, total_timesteps=180)
    steps = [int(path.stem[5:]) for path in sorted((tmp_path / "checkpoints").iterdir())]
    assert steps == [0, 120, 180], "between two rollouts, of 60 steps"


def test_steps_are_begun_in_all_before_one_is_taken(tmp_path: Path, monkeypatch) -> None:
    options = {"num_envs": 2, "env_kwargs": {"noise": 0.05}, "eval_frequency": 0}
    plain = train(tmp_path / "plain", "ppo", **options, env_id=POLE)
    env_id = register_with(monkeypatch, Elsewhere)
    Elsewhere.calls.clear()
    begun = train(tmp_path / "begun", "ppo", **options, env_id=env_id)
    names = [name for name, _ in Elsewhere.calls]
    assert names[:8] == ["begin", "begin", "step", "step"] * 2
    assert_same(checkpoint(plain)["policy"], checkpoint(begun)["policy"])
    alone = train(tmp_path / "alone", "ppo", env_id=env_id, env_kwargs={"noise": 0.05})
    assert summary(alone)["complete"], "a single one takes its steps at once"


def test_the_record_says_with_which_version(whole) -> None:
    import stable_baselines3

    told = runs.record(whole("ppo"))["versions"]
    assert told["stable_baselines3"] == stable_baselines3.__version__


def test_a_resumed_training_goes_on_with_figures_and_networks(whole, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(whole("ppo"), tmp_path / "run"))
    before, state = summary(folder), checkpoint(folder)
    runs.resume(folder, total_timesteps=512)
    after, later = summary(folder), checkpoint(folder)
    assert after["steps"] == 512 and after["complete"]
    assert after["returns"][: len(before["returns"])] == before["returns"]
    assert [step for step, _ in after["evaluations"]] == [128, 256, 320, 448, 512]
    runs.assert_no_doubles(folder)
    optimizers = [each["optimizers"]["policy.optimizer"]["state"][0]["step"]
                  for each in (state, later)]  # fmt: skip
    assert optimizers[1] == 2 * optimizers[0] > 0
    assert runs.record(folder)["run"]["total_timesteps"] == 512


def test_the_state_comes_back_whole(whole) -> None:
    from rl_workbench.training.environments import close_all, training_environments
    from rl_workbench.training.sb3.adapter import make

    saved = torch.load(whole("sac") / "last.pt", weights_only=True)
    options = runs.small("sac")
    envs = training_environments(options)
    training = make(options, envs)
    training.load_state_dict(saved)
    again = training.state_dict()
    assert saved["buffer"]["full"] and saved["entropy"] is not None
    for name in again:
        mine, other = saved[name], again[name]
        assert_same(*(dict(each) if isinstance(each, dict) else each for each in (mine, other)))
    close_all(envs)


def test_what_is_learned_after_the_last_step_is_saved(tmp_path: Path) -> None:
    """On-policy it learns from its last rollout once all steps are done."""
    from stable_baselines3 import PPO

    folder = train(tmp_path, "ppo", eval_frequency=0, checkpoint_frequency=256)
    model = dict(PPO.load(folder / "model.zip").policy.state_dict())
    for name in ("last.pt", "best.pt"):
        assert_same(dict(weights(folder / name)), model)


def test_a_rate_that_blows_up(tmp_path: Path) -> None:
    huge = {"learning_rate": 1e30, "total_timesteps": 640, "eval_frequency": 64}
    line = runs.failure(lambda: train(tmp_path, "ppo", **huge))
    assert "the weights are NaN or infinite: a smaller learning_rate may help" in line
    assert "continues from the last checkpoint" in line
    assert summary(tmp_path)["failure"] and not summary(tmp_path)["complete"]
    assert all(torch.isfinite(each).all() for each in weights(tmp_path / "last.pt").values())


def test_a_rate_that_torch_refuses(tmp_path: Path) -> None:
    options = {"learning_rate": 1e38, "learning_starts": 10, "buffer_size": 50}
    with pytest.raises(WorkbenchError, match=r"^dqn-sb3 failed: [^\n]*--resume"):
        runs.run(options_of("dqn-sb3", options), tmp_path)
    assert summary(tmp_path)["failure"]
