"""Trainings with Stable-Baselines3: the same run folder, and algorithms that don't fit."""

import json
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
import workbench_runs
import yaml
from gymnasium.envs.classic_control import CartPoleEnv
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from rl_workbench import cli
from rl_workbench.errors import WorkbenchError

pytestmark = [pytest.mark.usefixtures("signals"), pytest.mark.extras("stable_baselines3")]

OFF_POLICY = {"total_timesteps": 200, "learning_starts": 50, "buffer_size": 500, "n_steps": None,
              "batch_size": 16, "env_id": "Pendulum-v1", "eval_frequency": 100}  # fmt: skip


@pytest.fixture(scope="module")
def ppo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return workbench_runs.sb3(tmp_path_factory.mktemp("sb3") / "run", n_envs=2)


def work(*arguments: object) -> int:
    return cli.main([str(each) for each in arguments])


def test_a_training_leaves_the_same_folder_as_the_others(ppo: Path) -> None:
    names = {path.name for path in ppo.iterdir() if not path.name.startswith("events.out")}
    assert names == {"config.json", "scalars.csv", "summary.json", "learning_curve.png",
                     "checkpoints", "best.pt", "last.pt", "model.zip"}  # fmt: skip
    summary = json.loads((ppo / "summary.json").read_text())
    assert summary["steps"] == 256 and summary["complete"] and summary["failure"] is None
    assert summary["episodes"] == len(summary["returns"]) > 0
    assert [step for step, _ in summary["evaluations"]] == [128, 256]


def test_tags(ppo: Path) -> None:
    log = EventAccumulator(str(ppo))
    log.Reload()
    assert set(log.Tags()["scalars"]) >= {
        "charts/episodic_return",
        "charts/episodic_length",
        "charts/SPS",
        "losses/value_loss",
        "losses/policy_loss",
        "eval/mean_reward",
    }


def test_its_checkpoint_loads_safely(ppo: Path) -> None:
    content = torch.load(ppo / "best.pt", weights_only=True)
    assert content["policy"] and content["config"]["algorithm"] == "ppo"


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
    assert work("policy", ppo, "--out", tmp_path / "b.png") == 0
    assert work("compare", ppo, "--episodes", 1, "--out", tmp_path / "c.png") == 0


def test_the_policy_is_the_one_that_was_trained(ppo: Path) -> None:
    from stable_baselines3 import PPO

    from rl_workbench.tools.runs.policies import load_learned
    from rl_workbench.tools.runs.runs import open_run

    learned = load_learned(open_run(ppo), "last")
    model = PPO.load(ppo / "model.zip")
    env = gymnasium.make("CartPole-v1")
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        assert learned.act(observation) == model.predict(observation, deterministic=True)[0]


@pytest.mark.parametrize(
    ("algorithm", "options", "meaning"),
    [("ppo", {"n_envs": 2}, "P(right) - P(left)"),
     ("dqn-sb3", OFF_POLICY | {"env_id": "CartPole-v1"}, "Q(right) - Q(left)")],
)  # fmt: skip
def test_a_choice_is_drawn_by_how_much_it_is_preferred(
    tmp_path: Path, algorithm: str, options: dict, meaning: str
) -> None:
    from rl_workbench.tools.runs.policies import load_learned
    from rl_workbench.tools.runs.runs import open_run

    run = workbench_runs.sb3(tmp_path / "run", algorithm, **options)
    learned = load_learned(open_run(run))
    observations = np.random.default_rng(0).normal(size=(50, 4)).astype(np.float32)
    preferred = learned.preference(observations)
    assert preferred.shape == (50,) and len(np.unique(preferred)) > 10
    assert learned.meaning == meaning
    chosen = [learned.act(each) for each in observations]
    assert [int(value > 0) for value in preferred] == chosen
    learned.env.close()


def test_the_same_seed_learns_the_same(tmp_path: Path) -> None:
    first, second = (workbench_runs.sb3(tmp_path / name) for name in ("first", "second"))
    returns = [json.loads((run / "summary.json").read_text())["returns"] for run in (first, second)]
    assert returns[0] == returns[1]


@pytest.mark.parametrize("algorithm", ["sac", "td3", "ddpg"])
def test_an_algorithm_that_doesnt_fit_names_those_that_do(
    tmp_path: Path, algorithm: str, capsys
) -> None:
    code = work("train", "--algo", algorithm, "--env-id", "CartPole-v1", "--run-dir", tmp_path)
    assert code == 1
    line = capsys.readouterr().err
    assert "Discrete(2)" in line and "ppo, a2c, dqn-sb3, dqn_train.py fit it" in line


def test_dqn_doesnt_fit_the_swing_up(tmp_path: Path, capsys) -> None:
    assert work("train", "--algo", "dqn-sb3", "--env-id", "cartpole/SwingUp-v0") == 1
    assert "ppo, a2c, sac, td3, ddpg fit it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        (["--params", "learning_rat=1"], "did you mean learning_rate?"),
        (["--params", "gamma"], "isn't KEY=VALUE"),
        (["--params", "batch_size=hello"], "batch_size is a whole number from 1 on, not 'hello'"),
        (["--learning-rate", "hello"], "ppo can't be made"),
        (["--gamma", "5"], "gamma is a number from 0 to 1, not 5"),
        (["--n-epochs", "0"], "n_epochs is a whole number from 1 on, not 0"),
        (["--net-arch", "64,wide"], "net_arch is whole numbers, as in 64,64"),
        (["--params", "gamma=["], "isn't a value"),
        (["--device", "nonsense"], "ppo can't be made"),
        (["--env-id", "CartPol-v1"], "did you mean CartPole-v1?"),
    ],
)
def test_wrong_options(flags: list[str], told: str, capsys) -> None:
    given = ["train", "--algo", "ppo", "--env-id", "CartPole-v1", *flags]
    assert work(*given) == 1
    line = capsys.readouterr().err
    assert told in line and "Traceback" not in line


def test_a_folder_in_use(ppo: Path, capsys) -> None:
    assert work("train", "--algo", "ppo", "--run-dir", ppo) == 1
    assert "isn't empty" in capsys.readouterr().err


def test_the_weights_of_another_run_are_refused(ppo: Path, tmp_path: Path, capsys) -> None:
    other = workbench_runs.sb3(tmp_path / "run", net_arch="[8]")
    (other / "best.pt").write_bytes((ppo / "best.pt").read_bytes())
    assert work("eval", other) == 1
    assert "isn't a checkpoint of" in capsys.readouterr().err


def test_every_section_of_the_configuration_can_be_read(root: Path) -> None:
    for name in yaml.safe_load((root / "config/sb3.yaml").read_text()):
        algorithm, _, env_id = name.partition(" ")
        from rl_workbench.training.sb3.model import make_model
        from rl_workbench.training.sb3.settings import choose

        choice = choose(algorithm, ["--env-id", env_id])
        assert choice.run.total_timesteps >= 10_000 and choice.hyperparameters
        if not env_id.startswith("LunarLander"):
            make_model(choice).get_env().close()


def test_a_section_that_names_an_unknown_option(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("ppo CartPole-v1: {gama: 0.9}")
    flags = ["--env-id", "CartPole-v1", "--config", str(tmp_path / "a.yaml")]
    from rl_workbench.training.sb3.settings import choose

    with pytest.raises(WorkbenchError, match="did you mean gamma"):
        choose("ppo", flags)


class OneRobot(CartPoleEnv):
    """Stands for an environment over ROS: a second one would move the same robot."""

    shares_robot = True


@pytest.fixture
def one_robot() -> Iterator[str]:
    gymnasium.register("test/OneRobot-v0", OneRobot, max_episode_steps=50)
    yield "test/OneRobot-v0"
    del gymnasium.registry["test/OneRobot-v0"]


def test_where_there_is_one_robot_nothing_is_evaluated_while_it_learns(
    tmp_path: Path, one_robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    run = workbench_runs.sb3(tmp_path / "run", env_id=one_robot)
    assert "no evaluations during the training" in capsys.readouterr().out
    assert json.loads((run / "summary.json").read_text())["evaluations"] == []
    assert work("eval", run, "--episodes", 1) == 0
    with pytest.raises(WorkbenchError, match="n_envs is 1, not 2"):
        workbench_runs.sb3(tmp_path / "two", env_id=one_robot, n_envs=2)


def test_the_best_policy_is_confirmed_over_more_episodes(tmp_path: Path) -> None:
    run = workbench_runs.sb3(tmp_path / "run", confirm_episodes=3)
    rows = (run / "scalars.csv").read_text().splitlines()
    confirmed = [row.split(",") for row in rows if ",eval/confirmed_reward," in row]
    best = json.loads((run / "summary.json").read_text())["best"]
    assert confirmed and [int(confirmed[-1][0]), float(confirmed[-1][2])] == best
    assert (best[1] * 3) == pytest.approx(round(best[1] * 3))  # a mean of three, not of two
