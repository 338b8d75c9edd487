"""The commands of rl-workbench on trainings with Stable-Baselines3."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.training import workbench_runs

from rl_workbench import cli
from rl_workbench.tools.policies import load_learned
from rl_workbench.tools.runs import open_run

pytestmark = [pytest.mark.usefixtures("signals"), pytest.mark.extras("stable_baselines3")]

OFF_POLICY = {"total_timesteps": 200, "learning_starts": 50, "buffer_size": 500, "n_steps": None,
              "batch_size": 16, "env_id": "Pendulum-v1", "eval_frequency": 0,
              "eval_episodes": 1}  # fmt: skip


@pytest.fixture(scope="module")
def ppo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return workbench_runs.sb3(tmp_path_factory.mktemp("sb3") / "run", num_envs=2)


def work(*arguments: object) -> int:
    return cli.main([str(each) for each in arguments])


@pytest.mark.parametrize("algorithm", ["sac", "td3", "ddpg"])
def test_continuous_actions(tmp_path: Path, algorithm: str) -> None:
    run = workbench_runs.sb3(tmp_path / "run", algorithm, **OFF_POLICY)
    assert work("eval", run, "--episodes", 1, "--env-kwargs", "max_episode_steps=20") == 0


@pytest.mark.parametrize(
    ("algorithm", "options"),
    [("a2c", {"n_steps": 16, "batch_size": None}),
     ("dqn-sb3", OFF_POLICY | {"env_id": "CartPole-v1"})],
)  # fmt: skip
def test_single_actions(tmp_path: Path, algorithm: str, options: dict) -> None:
    run = workbench_runs.sb3(tmp_path / "run", algorithm, **options)
    assert work("eval", run, "--episodes", 1) == 0


def test_the_other_commands_take_it(ppo: Path, tmp_path: Path) -> None:
    assert work("eval", ppo, "--episodes", 2, "--checkpoint", "last") == 0
    assert work("record", ppo, "--out", tmp_path / "a.gif", "--max-steps", 10) == 0
    assert work("plot", ppo, "--out", tmp_path / "a.png") == 0
    assert work("compare", ppo, "--episodes", 1, "--out", tmp_path / "c.png") == 0


def test_the_policy_is_the_one_that_was_trained(ppo: Path) -> None:
    from stable_baselines3 import PPO

    learned = load_learned(open_run(ppo), "last")
    model = PPO.load(ppo / "model.zip")
    env = gymnasium.make("CartPole-v1")
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        assert learned.act(observation) == model.predict(observation, deterministic=True)[0]
    learned.env.close()


@pytest.mark.parametrize(
    ("algorithm", "options", "meaning"),
    [("ppo", {"num_envs": 2}, "P(right) - P(left)"),
     ("dqn-sb3", OFF_POLICY | {"env_id": "CartPole-v1"}, "Q(right) - Q(left)")],
)  # fmt: skip
def test_a_choice_is_drawn_by_how_much_it_is_preferred(
    tmp_path: Path, algorithm: str, options: dict, meaning: str
) -> None:
    run = workbench_runs.sb3(tmp_path / "run", algorithm, **options)
    learned = load_learned(open_run(run))
    observations = np.random.default_rng(0).normal(size=(50, 4)).astype(np.float32)
    preferred = learned.preference(observations)
    assert preferred.shape == (50,) and len(np.unique(preferred)) > 10
    assert learned.meaning == meaning
    chosen = [learned.act(each) for each in observations]
    assert [int(value > 0) for value in preferred] == chosen
    learned.env.close()


def test_the_weights_of_another_run_are_refused(ppo: Path, tmp_path: Path, capsys) -> None:
    other = workbench_runs.sb3(tmp_path / "run", net_arch="[8]")
    (other / "best.pt").write_bytes((ppo / "best.pt").read_bytes())
    assert work("eval", other) == 1
    assert "isn't a checkpoint of" in capsys.readouterr().err


def test_many_environments_of_training_are_one_when_playing(tmp_path: Path, recwarn) -> None:
    run = workbench_runs.sb3(tmp_path / "run", num_envs=8, n_steps=1, batch_size=8)
    recwarn.clear()
    assert work("eval", run, "--episodes", 1) == 0
    assert not [each for each in recwarn if "mini-batch" in str(each.message)]
