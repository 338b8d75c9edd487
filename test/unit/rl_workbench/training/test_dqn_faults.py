"""What goes wrong around a training: a clear line each, and nothing that was learned is lost."""

import io
import json
import math
import random
import resource
import shutil
import zipfile
from functools import partial
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
from learning_fakes import Dicing, register_with
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.hparams import plugin_data_pb2

from cartpole.environment import CartPoleEnv
from rl_workbench.agents.dqn.agent import DQNAgent
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.dqn import cli as dqn_cli
from rl_workbench.training.dqn.judge import Judge
from rl_workbench.training.dqn.policy import load_policy
from rl_workbench.training.dqn.settings import choose
from rl_workbench.training.run import checkpoints as run_checkpoints
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.environments import make_environment
from rl_workbench.training.run.files import save_tensors
from rl_workbench.training.run.interrupt import Interrupt


class Killed(Exception):
    """Nobody catches it, as nobody catches kill -9."""


SHORT = {"total_timesteps": 120, "eval_frequency": 0}


class Spoilt(gymnasium.Env):
    """Gives a number that is none at its 30th step."""

    observation_space = gymnasium.spaces.Box(-1, 1, (2,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, observation: float = 0.0, reward: float = 1.0) -> None:
        self.spoilt, self.steps = (observation, reward), 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(2, np.float32), {}

    def step(self, action):
        self.steps += 1
        number, reward = self.spoilt if self.steps == 30 else (0.0, 1.0)
        return np.array([0.0, number]), reward, self.steps % 7 == 0, False, {}


@pytest.fixture
def register(monkeypatch):
    return partial(register_with, monkeypatch)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short training that was never interrupted; not to be changed."""
    return train(tmp_path_factory.mktemp("short"), **SHORT)


@pytest.mark.parametrize("number", [math.nan, math.inf, -1e39])
@pytest.mark.parametrize("what", ["observation", "reward"])
def test_what_is_no_number_is_refused(register, what: str, number: float) -> None:
    env = make_environment(register(Spoilt), {what: number})
    env.reset(seed=0)
    for _ in range(29):
        env.step(0)
    words = f"the {what} of Spoilt-v0 isn't finite in float32: .*(nan|inf|-1.?e[+]39)"
    with pytest.raises(WorkbenchError, match=words):
        env.step(0)


def test_a_spoilt_observation_ends_training_and_evaluation(register, tmp_path: Path) -> None:
    options = SHORT | {"env_id": register(Spoilt), "env_kwargs": "observation=1e39"}
    with pytest.raises(
        WorkbenchError, match=r"observation of Spoilt.*stopped after 29 of 120.*--re"
    ):
        train(tmp_path / "run", **options)
    for path in (tmp_path / "run" / "last.pt", tmp_path / "run" / "failure.pt"):
        content = run_checkpoints.read(path)
        assert content["replay"]["observations"].isfinite().all()
    with pytest.raises(WorkbenchError, match=r"observation of Spoilt.*stopped after 20"):
        train(tmp_path / "judged", **(options | {"eval_frequency": 20, "eval_episodes": 9}))


@pytest.mark.extras("Box2D")
@pytest.mark.parametrize(
    ("env_id", "options", "words"),
    [("LunarLander-v3", {"gravity": 5}, "must be between -12 and 0"),
     ("FrozenLake-v1", {"map_name": "none"}, "'none'"),
     ("CartPole-v1", {"wheels": 4}, "unexpected keyword")],
)  # fmt: skip
def test_options_that_an_environment_refuses(env_id: str, options: dict, words: str) -> None:
    with pytest.raises(WorkbenchError, match=f"can't make {env_id}: .*{words}") as raised:
        make_environment(env_id, options)
    assert "\n" not in str(raised.value)


def test_there_is_something_to_resume_from_the_first_moment_on(
    short: Path, tmp_path: Path, monkeypatch
) -> None:
    def killed(*arguments: object) -> None:
        raise Killed

    monkeypatch.setattr(DQNAgent, "act", killed)
    with pytest.raises(Killed):
        train(tmp_path / "run", **SHORT)
    monkeypatch.undo()
    run = resume(tmp_path / "run")
    assert rows(run) == rows(short)
    assert_same(checkpoint(run)["q_net"], checkpoint(short)["q_net"])


def test_killed_between_the_names_of_a_best_checkpoint(tmp_path: Path, monkeypatch) -> None:
    """Resumed, the training comes to the same best checkpoint."""
    whole = train(tmp_path / "whole", total_timesteps=200)
    name = run_checkpoints._name
    named: list[str] = []

    def killed(path: Path, to: Path) -> None:
        name(path, to)
        named.append(f"{path.name} {to.name}")
        if len(named) > 1 and named[-2].split()[0] != path.name and "000150" in path.name:
            raise Killed

    monkeypatch.setattr(run_checkpoints, "_name", killed)
    with pytest.raises(Killed):
        train(tmp_path / "run", total_timesteps=200)
    monkeypatch.undo()
    assert_same_run(whole, resume(tmp_path / "run"))


def test_ctrl_c_on_a_full_disk_tells_that_it_could_not_save(tmp_path: Path, monkeypatch) -> None:
    def full(path: Path, content: object) -> None:
        if interrupt.signal is not None:
            raise OSError(28, "No space left on device", str(path))
        genuine(path, content)

    genuine, interrupt = run_checkpoints.save_tensors, InterruptAfter(40)
    monkeypatch.setattr(run_checkpoints, "save_tensors", full)
    with pytest.raises(WorkbenchError, match=r"No space left on device.*--resume"):
        train(tmp_path / "run", interrupt, **SHORT)


def test_a_training_killed_before_its_first_checkpoint_begins_anew(
    short: Path, tmp_path: Path
) -> None:
    run = train(tmp_path / "run", InterruptAfter(40), **SHORT)
    shutil.rmtree(run / "checkpoints")
    (run / "last.pt").unlink()
    mine, other = checkpoint(short), checkpoint(resume(run))
    for content in (mine, other):
        del content["config"]["run"]["run_dir"]
    assert_same(mine, other, "last.pt")
    assert rows(short) == rows(run)


def test_half_written_files_of_a_killed_training_are_removed(tmp_path: Path) -> None:
    run = train(tmp_path / "run", InterruptAfter(40), **SHORT)
    left = [run / "checkpoints" / ".step_000000070.pt.a1b2c3", run / ".config.json.d4e5f6",
            run / ".last.pt.new"]  # fmt: skip
    for path in left:
        path.write_bytes(b"half")
    mine = run / ".notes"
    mine.write_text("mine")
    resume(run)
    assert not any(path.exists() for path in left) and mine.exists()


def test_a_disk_that_is_full_in_the_midst_of_a_checkpoint(short: Path, tmp_path: Path) -> None:
    """The real writer on a real limit: torch hides the system's error behind one of its own."""
    path, content = tmp_path / "last.pt", run_checkpoints.read(short / "last.pt")
    save_tensors(path, {"old": 1})
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            save_tensors(path, content)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [each.name for each in tmp_path.iterdir()] == ["last.pt"]
    assert torch.load(path, weights_only=True) == {"old": 1}


def test_a_checkpoint_damaged_anywhere_is_told(tmp_path: Path) -> None:
    path, draw = tmp_path / "last.pt", random.Random(0)
    save_tensors(path, {"format": run_checkpoints.FORMAT, "tensor": torch.zeros(50)})
    good, damaged = path.read_bytes(), 0
    for _ in range(300):
        content = bytearray(good)
        for _ in range(draw.choice([1, 20])):
            content[draw.randrange(len(content))] = draw.randrange(256)
        path.write_bytes(content[: draw.choice([len(content), draw.randrange(len(content))])])
        try:
            assert run_checkpoints.read(path)["tensor"].eq(0).all()
        except WorkbenchError:
            damaged += 1
    assert damaged > 200


def test_a_damaged_archive_of_another_kind(tmp_path: Path) -> None:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data.pkl", random.Random(0).randbytes(3000).hex())
    content = bytearray(memory.getvalue())
    content[300:340] = b"\xff" * 40
    (tmp_path / "last.pt").write_bytes(content)
    with pytest.raises(WorkbenchError, match="damaged, or no checkpoint"):
        run_checkpoints.read(tmp_path / "last.pt")


@pytest.mark.parametrize("record", ['{"algorithm": "dqn"}', "[]", "{", "",
                                    '{"algorithm": "dqn", "run": [1], "dqn": {}}'])  # fmt: skip
def test_a_damaged_record_is_one_line(tmp_path: Path, record: str) -> None:
    (tmp_path / "config.json").write_text(record)
    with pytest.raises(WorkbenchError, match=r"isn't the configuration of|isn't JSON"):
        choose(["--resume", str(tmp_path)], {})


@pytest.mark.parametrize(("name", "value"), [("gamma", 0.5), ("hidden_sizes", [32])])
def test_a_record_that_somebody_changed_is_refused(
    tmp_path: Path, name: str, value: object
) -> None:
    run = train(tmp_path / "run", InterruptAfter(40), **SHORT)
    record = json.loads((run / "config.json").read_text())
    record["dqn"][name] = value
    (run / "config.json").write_text(json.dumps(record))
    with pytest.raises(WorkbenchError, match=f"config.json says {name} .*, the checkpoint"):
        resume(run)


def test_other_versions_are_told(tmp_path: Path, capsys) -> None:
    run = train(tmp_path / "run", InterruptAfter(40), **SHORT)
    record = json.loads((run / "config.json").read_text())
    record["versions"]["torch"] = "1.0"
    (run / "config.json").write_text(json.dumps(record))
    resume(run)
    assert f"torch 1.0 is now {torch.__version__}: from here on" in capsys.readouterr().out


@pytest.mark.parametrize("left", [None, 0, 10, 300])
def test_figures_that_were_lost_cost_nothing_else(
    short: Path, tmp_path: Path, capsys, left: int | None
) -> None:
    run = train(tmp_path / "run", InterruptAfter(80), **SHORT)
    path = run / "scalars.csv"
    if left is None:
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:left])
    resume(run)
    assert "lacks rows that it had" in capsys.readouterr().out
    assert_same(checkpoint(run)["q_net"], checkpoint(short)["q_net"])
    assert set(rows(run)) < set(rows(short)) and rows(run)
    without_doubles(run)


def test_a_moved_run_goes_on_where_it_lies(short: Path, tmp_path: Path) -> None:
    run = train(tmp_path / "run", InterruptAfter(40), **SHORT)
    moved = resume(run.rename(tmp_path / "elsewhere"))
    assert rows(moved) == rows(short)
    assert not run.exists()


def test_one_robot_for_training_and_evaluation(tmp_path: Path, monkeypatch) -> None:
    """Over ROS there is one; the episode under way goes on as if nobody had moved the robot."""
    options = {"env_id": "cartpole/Classic-v0", "total_timesteps": 200, "eval_frequency": 30}
    whole = train(tmp_path / "whole", **options)
    monkeypatch.setattr(CartPoleEnv, "shares_robot", True)
    run = train(tmp_path / "run", InterruptAfter(150), **options)
    assert rows(run) != rows(whole), "interrupted"
    assert_same_run(whole, resume(run))


def test_an_evaluation_leaves_the_shared_generators_alone(register, tmp_path: Path) -> None:
    options = {"env_id": register(Dicing), "total_timesteps": 200}
    judged = train(tmp_path / "judged", eval_frequency=30, **options)
    alone = train(tmp_path / "alone", eval_frequency=0, **options)
    assert (
        summary(judged)["evaluations"] and summary(judged)["returns"] == summary(alone)["returns"]
    )


def test_where_the_robot_cannot_be_brought_back_the_episode_is_given_up(
    tmp_path: Path, monkeypatch, capsys
) -> None:
    monkeypatch.setattr(CartPoleEnv, "shares_robot", True)
    monkeypatch.setattr("robot_envs.backends.in_process.InProcessRobot.deterministic", False)
    run = train(tmp_path / "run", env_id="cartpole/Classic-v0", total_timesteps=60,
                eval_frequency=25)  # fmt: skip
    assert "the episode under way is given up" in capsys.readouterr().err
    assert summary(run)["complete"]


def test_an_environment_of_its_own_is_closed_by_the_judge_alone(tmp_path: Path) -> None:
    run = small().run
    env = make_environment(run.env_id)
    agent = DQNAgent(small().dqn, 4, 2)
    assert Judge(run, agent, env, Interrupt().requested)._env is not env


def test_hyper_parameters_stand_beside_the_result(short: Path) -> None:
    log = EventAccumulator(str(short))
    log.Reload()
    content = log.PluginTagToContent("hparams")
    start = plugin_data_pb2.HParamsPluginData.FromString(
        content["_hparams_/session_start_info"]
    ).session_start_info
    assert start.hparams["gamma"].number_value == 0.99
    assert start.hparams["double"].string_value == "True"
    assert start.hparams["env_id"].string_value == "CartPole-v1"
    experiment = plugin_data_pb2.HParamsPluginData.FromString(
        content["_hparams_/experiment"]
    ).experiment
    metrics = {each.name.tag for each in experiment.metric_infos}
    assert metrics == {"eval/mean_reward", "charts/episodic_return"}
    assert not set(points(short)) & {"hp_metric"}


def test_a_checkpoint_of_another_environment(short: Path, tmp_path: Path) -> None:
    content = run_checkpoints.read(short / "last.pt")
    content["config"]["run"]["env_id"] = "Acrobot-v1"
    torch.save(content, tmp_path / "last.pt")
    with pytest.raises(WorkbenchError, match=r"last.pt doesn't fit Acrobot-v1: "):
        load_policy(tmp_path)


def test_which_checkpoint_a_folder_stands_for(tmp_path: Path) -> None:
    (tmp_path / "checkpoints").mkdir()
    names = ["last.pt", "best.pt", *(f"checkpoints/step_{step:09d}.pt" for step in (5, 999_999_999,
                                                                                10**9))]  # fmt: skip
    for name in names:
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "last.pt").unlink()
    (tmp_path / "last.pt").hardlink_to(tmp_path / "checkpoints/step_1000000000.pt")
    found = [str(path.relative_to(tmp_path)) for path in run_checkpoints.candidates(tmp_path)]
    assert found == ["last.pt", names[3], names[2], "best.pt"]
    assert run_checkpoints.candidates(tmp_path, best_first=True)[0].name == "best.pt"


def test_run_folders_of_one_second(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("time.time", lambda: 5.0)
    made = [run_folder.create(None, "cartpole/Classic-v0", "a/b:c", 0) for _ in range(3)]
    name = "cartpole-Classic-v0__a-b-c__0__5"
    assert [each.relative_to(tmp_path / "runs") for each in made] == [
        Path(name), Path(f"{name}_2"), Path(f"{name}_3")
    ]  # fmt: skip


def test_private_parameters_of_the_command_line(tmp_path: Path, monkeypatch) -> None:
    """As every node takes them: rosrun cartpole dqn_train.py _gamma:=0.5."""
    chosen = []
    monkeypatch.setattr(Interrupt, "install", lambda self: self)
    monkeypatch.setattr(dqn_cli, "run", lambda choice, interrupt: chosen.append(choice) or 0)
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    assert dqn_cli.main(["_gamma:=0.5", "--seed=3", "_seed:=4", "_dueling:=true"]) == 0
    assert (chosen[0].dqn.gamma, chosen[0].run.seed, chosen[0].dqn.dueling) == (0.5, 3, True)
