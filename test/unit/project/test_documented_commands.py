"""Every command in the documentation is one that its program takes: flags, files, arguments, requests.

test_tutorial.py, test_tutorial_robot.py and test_catkin_workspace.py run those of their pages. A command
that no test here knows how to check is a fault.
"""

from __future__ import annotations

import argparse
import itertools
import re
import runpy
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, NoReturn
from xml.etree import ElementTree

import genpy
import pytest
import rospkg
import yaml
from bullet_gazebo_msgs.srv import RestoreStateRequest, SaveStateRequest, StepWorldRequest
from gazebo_msgs.srv import GetWorldPropertiesRequest
from std_srvs.srv import EmptyRequest
from support.python import run

from bullet_gazebo.clients import gzclient
from bullet_gazebo.journal import journal_output
from bullet_gazebo.node import replay_command
from cartpole import dqn_train, pg_train, policy_node, workbench
from lockstep_runner import launcher as lockstep_launcher
from package_writing import check_cli as check_robot
from package_writing import cli as new_robot
from rl_workbench.training import train as training_cli
from rl_workbench.training.algorithms import ALGORITHMS

ROOT = Path(__file__).resolve().parents[3]
RUN_ELSEWHERE = (
    "docs/tutorial_dqn.md", "docs/tutorial_dqn.zh.md", "docs/tutorial_robot.md", "docs/tutorial_robot.zh.md",
    "docs/catkin.md", "docs/mobile.md", "docs/testing.md",
)  # fmt: skip
STARTS = re.compile(r"(\./ws|rosrun|roslaunch|rosservice|gz|spawn_model)\s")
PLACEHOLDERS = {"your_script.py", "my_arm"}  # the reader's own
RUN_BY_TESTS = (
    "examples/own_task.py", "examples/plot_policy.py", "examples/ppo_over_ros.py",
    "examples/episode_over_services.py", "examples/test_robot_without_gazebo.py",
    *(f"examples/{name}.py" for name in (
        "first_episode", "own_robot", "many_worlds", "varied_robot", "sensor_readings", "record_gif",
        "snapshot_file", "steps_over_ros", "dqn_from_saved_states", "bag_to_mcap", "to_rerun",
    )),
)  # fmt: skip
TRAININGS = {"pg_train.py": pg_train.main, "dqn_train.py": dqn_train.main}
PARSED = {
    "new_robot.py": new_robot.main, "check_robot.py": check_robot.main,
    "lockstep.py": lockstep_launcher.main, "replay.py": replay_command.main,
}  # fmt: skip
THEIR_ENVIRONMENT = """
import gymnasium
gymnasium.register("MyEnv-v0", "gymnasium.envs.classic_control:CartPoleEnv", max_episode_steps=50)
"""
SHORT = ["--episodes=2", "--eval-episodes=1"]
REQUESTS = {
    "/gazebo/get_world_properties": GetWorldPropertiesRequest,
    "/gazebo/step_world": StepWorldRequest,
    "/gazebo/save_state": SaveStateRequest,
    "/gazebo/restore_state": RestoreStateRequest,
    "/gazebo/unpause_physics": EmptyRequest,
}


class Command(NamedTuple):
    page: str
    words: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.page}: {' '.join(self.words)}"


def commands() -> Iterator[Command]:
    """All commands in blocks of code, without ./ws in front and remarks behind."""
    tools = runpy.run_path(str(ROOT / "tools/check_links.py"))
    for path in tools["markdown_files"](ROOT):
        page = str(path.relative_to(ROOT))
        if page not in RUN_ELSEWHERE:
            for block in tools["BLOCK"].finditer(path.read_text(encoding="utf-8")):
                text = block["fenced"] or block["indented"] or ""
                for line in re.sub(r"\\\n", " ", text).splitlines():
                    if found := STARTS.match(line.strip()):
                        words = shlex.split(line.strip()[found.start() :], comments=True)
                        words = words[words[0] == "./ws" :]
                        if words[0] in ("--with", "env"):  # run by test_ws_with.py; a variable
                            words = words[2:]
                        yield Command(page, tuple(words))


ALL = sorted(set(commands()))


class Parsed(BaseException):
    """The command line was taken; nothing of it is done."""


@pytest.fixture
def only_parsing(monkeypatch: pytest.MonkeyPatch) -> None:
    take = argparse.ArgumentParser.parse_args

    def parse(self: argparse.ArgumentParser, *arguments: object, **options: object) -> NoReturn:
        take(self, *arguments, **options)
        raise Parsed

    monkeypatch.setattr(argparse.ArgumentParser, "parse_args", parse)


def of(*starts: str) -> list[Command]:
    chosen = []
    for command in ALL:
        words = command.words[command.words[0] == "extras" :]
        if any(" ".join(words).startswith(start) for start in starts):
            chosen.append(Command(command.page, words))
    return chosen


GROUPS = {
    "trainings": of("rosrun cartpole pg_train.py", "rosrun cartpole dqn_train.py"),
    "workbench": of("rosrun cartpole workbench.py"),
    "policies": of("rosrun cartpole policy_node.py"),
    "scripts": of("python3"),
    "launches": of("roslaunch"),
    "requests": of("rosservice call"),
    "programs": of(*(f"rosrun cartpole {name}" for name in PARSED)),
    "tests": of("test", "rostest", "check", "shell", "tensorboard"),
    "window": of("rosrun gazebo_ros gzclient"),
    "bags": of("rosbag record"),
    "clusters": of("ray"),
    "gains": of("rosrun dynamic_reconfigure dynparam set"),
}


def test_every_command_is_looked_at() -> None:
    assert ALL
    known = {(command.page, command.words) for group in GROUPS.values() for command in group}
    seen = {each: (each.page, each.words[each.words[0] == "extras" :]) for each in ALL}
    assert [str(each) for each, command in seen.items() if command not in known] == []


@pytest.mark.slow
@pytest.mark.parametrize("command", GROUPS["trainings"], ids=str)
def test_a_training_runs(command: Command, tmp_path: Path, monkeypatch, capsys) -> None:
    """A short one, without ROS; to draw its curves would take longer."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("rl_workbench.plotting.as_png", lambda figure: lambda file: file.write(b""))
    *_, program = command.words[:3]
    flags = list(command.words[3:])
    if "--help" in flags:
        with pytest.raises(SystemExit, match="^0$"):
            TRAININGS[program](flags)
        return
    flags += SHORT
    if program == "pg_train.py" and not any(flag.startswith("--env-id") for flag in flags):
        flags.append("--backend=bullet")
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "my_env.py").write_text(THEIR_ENVIRONMENT)
    assert TRAININGS[program](flags) == 0, capsys.readouterr()


@pytest.mark.parametrize("command", GROUPS["programs"], ids=str)
def test_a_program_takes_it(command: Command, only_parsing: None, monkeypatch) -> None:
    parser = argparse.ArgumentParser
    monkeypatch.setattr(parser, "parse_intermixed_args", parser.parse_args)
    _, _, program, *words = command.words
    if program == "replay.py":
        given = [word.partition("=")[2] for word in words if "=" in word]
        own = [path for path in given if PLACEHOLDERS.isdisjoint(Path(path).parts)]
        assert all((ROOT / path).is_file() for path in own)
    with pytest.raises(Parsed):
        PARSED[program](words)


@pytest.mark.parametrize("command", GROUPS["window"], ids=str)
def test_the_window_takes_it(command: Command) -> None:
    assert gzclient.parse_args(command.words[3:]).ignored == []


@pytest.mark.parametrize("command", GROUPS["bags"], ids=str)
def test_a_topic_that_is_recorded_is_the_simulators(command: Command) -> None:
    assert command.words[-1] == journal_output.TOPIC


def with_extras(command: Command) -> object:
    """The command, which needs the package of the algorithm that it names."""
    words = dict(itertools.pairwise(command.words))
    package = ALGORITHMS[words.get("--algo", "dqn")].package
    return pytest.param(command, marks=[pytest.mark.extras(package[0])] if package else [])


@pytest.mark.parametrize("command", [*map(with_extras, GROUPS["workbench"])], ids=str)
def test_the_workbench_takes_it(command: Command, only_parsing: None, monkeypatch) -> None:
    name, *arguments = command.words[3:]
    if name == "--help":
        return
    if name == "train":  # has a parser of its own
        if "--resume" in arguments:  # needs a run; test_tutorial.py has one
            return

        def begin(*_: object, **__: object) -> NoReturn:
            raise Parsed

        monkeypatch.setattr(training_cli, "run_training", begin)
    if name == "benchmark" and arguments and not arguments[0].startswith("-"):
        suites = yaml.safe_load((ROOT / "config/benchmark.yaml").read_text(encoding="utf-8"))
        assert arguments[0] in suites or arguments[0] == "SUITE"
    with pytest.raises(Parsed):
        workbench.main([name, *arguments])


@pytest.mark.extras("ray")
@pytest.mark.parametrize("command", GROUPS["clusters"], ids=str)
def test_ray_takes_it(command: Command) -> None:
    from ray.scripts.scripts import cli

    name, *arguments = command.words[1:]
    if cli.commands[name].make_context(name, arguments).params.get("block"):
        pytest.fail("the terminal would be taken")


@pytest.mark.parametrize("command", GROUPS["policies"], ids=str)
def test_a_policys_node_takes_it(command: Command) -> None:
    own = [word for word in command.words[3:] if ":=" not in word]  # others are ROS's
    assert policy_node.parse(own, {}).run


@pytest.mark.parametrize("command", GROUPS["scripts"], ids=str)
def test_a_script_takes_it(command: Command, only_parsing: None, monkeypatch) -> None:
    script, *arguments = command.words[1:]
    if script in PLACEHOLDERS or not set(RUN_BY_TESTS).isdisjoint(command.words):
        return
    monkeypatch.setattr(sys, "argv", [script, *arguments])
    monkeypatch.setattr(sys, "path", [str((ROOT / script).parent), *sys.path])
    try:
        with pytest.raises(Parsed):
            runpy.run_path(str(ROOT / script), run_name="__main__")
    except ModuleNotFoundError as error:
        if error.name != "stable_baselines3":
            raise
        pytest.skip(f"{error.name} missing: ./ws extras installs requirements/extras.txt")


@pytest.mark.parametrize("command", GROUPS["launches"], ids=str)
def test_a_launch_file_takes_the_arguments(command: Command) -> None:
    package, name, *arguments = command.words[1:]
    if package in PLACEHOLDERS:
        return
    file = Path(rospkg.RosPack().get_path(package), "launch", name)
    known = {each.get("name") for each in ElementTree.parse(file).iter("arg")}
    assert {argument.partition(":=")[0] for argument in arguments} <= known


@pytest.mark.parametrize("command", GROUPS["requests"], ids=str)
def test_a_request_fits_its_service(command: Command) -> None:
    service, *texts = command.words[2:]
    values = [yaml.safe_load(text) for text in texts]
    genpy.message.fill_message_args(REQUESTS[service](), values)


@pytest.mark.parametrize("command", GROUPS["gains"], ids=str)
def test_a_gain_is_one_of_a_controllers(command: Command) -> None:
    node, name, value = command.words[4:]
    controller = node.strip("/").removesuffix("/pid")
    file = ROOT / "companions/cartpole_controller/config"
    texts = [path.read_text(encoding="utf-8") for path in file.glob("*.yaml")]
    assert any(controller in text for text in texts)
    assert name in ("p", "i", "d", "i_clamp") and float(value) >= 0


@pytest.mark.slow
@pytest.mark.parametrize("command", GROUPS["tests"], ids=str)
def test_ws_takes_it(command: Command, tmp_path: Path) -> None:
    name, *arguments = command.words
    if name == "shell":
        return  # test_ws_shell.py
    if name in ("rostest", "tensorboard"):
        assert all((ROOT / each).exists() for each in arguments if each.startswith("test/"))
        return
    if name == "check":
        script = f"source {ROOT}/tools/ws_check.sh; printf '%s\\n' \"${{CHECKS[@]}}\""
        done = run(["bash", "-c", script], check=True)
        assert set(arguments) <= set(done.stdout.split())
        return
    arguments = [argument for argument in arguments if argument != "--fast"]  # ws's own
    if not arguments:
        return
    is_whole = not any(argument.startswith("test/") for argument in arguments)
    if is_whole:  # one quick file will do to see that the options are known
        arguments.append("test/unit/project/test_ci.py")
    collect = ("--collect-only", "-qq", "-p", "no:cacheprovider")
    found = run([sys.executable, "-m", "pytest", *collect, *arguments], cwd=ROOT)
    none_of_the_part = pytest.ExitCode.NO_TESTS_COLLECTED
    is_fine = found.returncode == 0 or (is_whole and found.returncode == none_of_the_part)
    assert is_fine, found.stdout
