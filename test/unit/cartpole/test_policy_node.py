"""The command policy_node.py: what it makes of its arguments, and which policies it takes."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.training import workbench_runs

import cartpole  # noqa: F401 - registers the environments
from cartpole import policy_node
from cartpole.robot import ROBOT
from cartpole.tasks import BalanceTask
from rl_workbench import cli
from rl_workbench.errors import WorkbenchError
from rl_workbench.tools import torchscript
from robot_envs.errors import RobotEnvError

ROBOT_RUN = {"env_id": "cartpole/Balance-v0", "episodes": 2, "eval_frequency": 0}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "robot"
    kwargs = {"noise": 0.03, "control_period": 0.016, "max_steps": 20}
    return workbench_runs.policy_gradient(folder, "reinforce", **ROBOT_RUN, env_kwargs=kwargs)


@pytest.fixture(scope="module")
def exported(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("files") / "policy.pt"
    assert cli.main(["export", str(run), "--out", str(out)]) == 0
    return out


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["run", "exported"])
def test_a_run_or_a_file_brings_robot_task_and_period(kind: str, request) -> None:
    path = request.getfixturevalue(kind)
    robot, task, act, period = policy_node.load(path, "best", {})
    assert robot is ROBOT and isinstance(task, BalanceTask)
    assert period == 0.016 and task.noise == 0.03
    assert act(np.zeros(4, np.float32)) in (0, 1)
    assert policy_node.load(path, "best", {"control_period": 0.01}).period == 0.01


def test_a_run_that_learned_over_ros_needs_no_simulator_here(run: Path) -> None:
    options = {"backend": "ros-realtime", "control_period": 0.0}
    assert policy_node.load(run, "last", options).period == ROBOT.control_period


def test_policies_of_other_environments_are_refused(tmp_path: Path) -> None:
    other = workbench_runs.dqn(tmp_path / "run", total_timesteps=100)
    with pytest.raises(RobotEnvError, match="policy of CartPole-v1, which is not an environment"):
        policy_node.load(other, "best", {})


def test_an_exported_policy_of_another_task_is_refused(exported: Path, monkeypatch) -> None:
    monkeypatch.setattr(torchscript, "open_exported", renamed("cartpole/SwingUp-v0"))
    with pytest.raises(WorkbenchError, match="observation space than cartpole/SwingUp-v0 has"):
        policy_node.load(exported, "best", {})


def renamed(env_id: str):
    from rl_workbench.tools.torchscript import ExportedPolicy, open_exported

    def opened(path: Path) -> ExportedPolicy:
        act, metadata = open_exported(path)
        return ExportedPolicy(act, metadata | {"env_id": env_id})

    return opened


@pytest.mark.parametrize(
    "wrong",
    [["--late", "0"], ["--late", "nan"], ["--max-speed", "-1"], ["--goal", "a"], ["--sead", "1"],
     ["--checkpoint", "worst"], ["--seed", "-1"]],
)  # fmt: skip
def test_wrong_arguments(wrong: list[str], capsys) -> None:
    with pytest.raises(SystemExit) as end:
        policy_node.main(["RUN", *wrong])
    assert end.value.code == 2
    assert wrong[0].lstrip("-") in capsys.readouterr().err


def test_private_parameters_are_options_and_flags_count_more() -> None:
    parameters = {"late": 0.3, "max_speed": 0, "goal": [0.1, -0.2], "seed": 4}
    found = policy_node.parse(["RUN", "--seed=5"], parameters)
    assert (found.late, found.max_speed, found.goal, found.seed) == (0.3, 0.0, [0.1, -0.2], 5)
    assert found.run == Path("RUN")


def test_a_mistake_in_a_task_is_one_line_with_its_place(run: Path, monkeypatch, capsys) -> None:
    from robot_envs.deployment import policy_node as node

    def fails(*arguments: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(node, "run_node", fails)
    assert policy_node.main([str(run)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "the robot is stopped, the task failed: ZeroDivisionError: division by zero (" in line
    assert "test_policy_node.py:" in line


def test_without_a_master_it_says_so(run: Path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    assert policy_node.main([str(run)]) == 1
    told = capsys.readouterr()
    assert "there is no ROS master at http://127.0.0.1:1" in told.err
    assert told.out == f"loading the policy of {run}\n"


@pytest.mark.parametrize("opens", ["open_run", "open_exported"])
def test_a_policy_behind_a_wrapper_is_refused_before_there_is_an_environment(
    opens: str, tmp_path: Path, monkeypatch
) -> None:
    found = SimpleNamespace(wrapper="mine:wrap", metadata={"wrapper": "mine:wrap"})
    for module in (policy_node, torchscript):
        monkeypatch.setattr(module, opens, lambda path: found, raising=False)
    path = tmp_path if opens == "open_run" else tmp_path / "policy.pt"
    with pytest.raises(RobotEnvError, match="learned through the wrapper mine:wrap"):
        policy_node.load(path, "best", {})
