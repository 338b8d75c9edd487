"""Every command of docs/tutorial_robot.md, docs/mobile.md and docs/testing.md in order: own packages.

Trainings are shorter. A block `sh skip` is another way to begin. One that names a file is put at its end.
Simulations are started, seen to be there, and ended; with RViz their launch files are read. The workbench's
commands run in this process, but for those over ROS: to start each takes seconds.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import shlex
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.pages.code_blocks import Block, blocks
from support.python import run

from cartpole import workbench
from robot_envs.backends.ros.bringup import ready
from robot_envs.scene import Scene
from ros_calls import master
from ros_calls.waiting import wait_until
from ros_utils.ros_gazebo import gazebo_set_max_update_rate
from ros_utils.simulation import reserved_port

ROOT = Path(__file__).resolve().parents[3]
ARM, VEHICLE, TESTS = (ROOT / "docs" / f"{name}.md" for name in ("tutorial_robot", "mobile", "testing"))
LIMIT = 300.0  # [s] for one command
SHORT = "--total-timesteps 150 --eval-frequency 150 --eval-episodes 1 --confirm-episodes 1"
SHORTER = {
    "ppo": f"{SHORT} --n-steps 75 --n-epochs 1",
    "sac": f"{SHORT} --learning-starts 100",
    "eval": "--episodes 1",
    "record": "--max-steps 10 --size 160x120",
    "train.launch": f"'more:={SHORT} --learning-starts 100'",
}


@pytest.fixture(scope="module")
def environment() -> dict[str, str]:
    """A user's, with a master of its own."""
    plain = {name: os.environ[name] for name in ("HOME", "CARTPOLE_WS_DIR") if name in os.environ}
    return {**plain, "ROS_MASTER_URI": f"http://127.0.0.1:{reserved_port()}", "PYTHONUNBUFFERED": "1",
            "PATH": "/usr/local/bin:/usr/bin:/bin", "OMP_NUM_THREADS": "1"}  # fmt: skip


class Reader:
    """Somebody who does what the page says, in a folder beside which the package is written.

    Args:
        folder: where commands run.
        environment: of theirs.
        package: its name.
    """

    def __init__(self, folder: Path, environment: dict[str, str], package: str) -> None:
        self.folder, self.environment, self.package = folder, environment, package
        self.place = str(folder.parent / package)
        self.simulation: subprocess.Popen[str] | None = None
        self.done: set[str] = set()

    def read(self, block: Block) -> None:
        if block.mark == "skip" or block.language == "text":
            return
        if block.language == "python" or block.mark:
            self.write(block)
            return
        for line in block.text.splitlines():
            if line not in self.done or "roslaunch" in line:
                self.do(shlex.split(line, comments=True))
                self.done.add(line)

    def write(self, block: Block) -> None:
        if block.mark:
            path = self.folder / block.mark
            path.parent.mkdir(exist_ok=True)
            with path.open("a", encoding="utf-8") as file:
                file.write(f"\n\n{block.text}" if file.tell() else block.text)
        else:
            self.run(["--with", self.place, "python3", "-c", block.text])

    def do(self, words: list[str]) -> None:
        if words[0] == "chmod":
            subprocess.run(words, cwd=self.folder, check=True)
            return
        assert words[0] == "./ws", words
        if words[1] == "extras":  # a test installs nothing; `ws test` has done so
            return
        words = [each.replace("../", f"{self.folder.parent}/") for each in words[1:]]
        if "new_robot.py" in words:
            words = [each.replace("urdf/", f"{ROOT}/urdf/") for each in words]
            words += ["--to", str(self.folder.parent)]
        elif "roslaunch" in words:
            self.launch(words)
            return
        elif "test" in words and words[-1].endswith("/my_arm"):
            words += ["-k", "promise"]  # the others run by the page about tests
        elif "rostopic" in words:
            assert self.simulation is not None
        elif "policy_node.py" in words:
            self.move(words)
            return
        elif "workbench.py" in words:
            self.end_simulation()
            command = words[words.index("workbench.py") + 1]
            kind = words[words.index("--algo") + 1] if command == "train" else command
            words += SHORTER.get(kind, "").split()
            if "backend=ros" not in words:
                self.work(words[words.index("workbench.py") + 1 :])
                return
        self.run(words)

    def work(self, arguments: list[str]) -> None:
        """Runs a command of the workbench here, with the package as it is now."""
        with self.fresh():
            assert workbench.main(arguments) == 0, arguments

    @contextlib.contextmanager
    def fresh(self) -> Iterator[None]:
        """The next command, and the next test, find what is written of the package then."""
        try:
            yield
        finally:
            for name in [each for each in sys.modules if each.partition(".")[0] == self.package]:
                del sys.modules[name]

    def launch(self, words: list[str]) -> None:
        self.end_simulation()
        if "rviz:=true" in words:
            words.insert(words.index("roslaunch") + 1, "--nodes")
            assert {"/rviz", "/gazebo"} <= set(self.run(words).split())
        elif "train.launch" in words:
            self.run([*words, *shlex.split(SHORTER["train.launch"])])
        else:
            self.simulation = subprocess.Popen(
                [ROOT / "ws", *words, "gui:=false"], cwd=self.folder, env=self.environment, text=True,
                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
            )  # fmt: skip
            with master.using(self.environment["ROS_MASTER_URI"]), self.fresh():
                robot = importlib.import_module(f"{self.package}.robot").ROBOT
                assert wait_until(master.is_up, LIMIT, "the master")
                ready(Scene([robot])).wait(LIMIT)
                assert gazebo_set_max_update_rate(0.3)  # of real time: whoever comes next takes a while

    def move(self, words: list[str]) -> None:
        """Has the policy move the simulated robot, and ends it with Ctrl-C."""
        assert self.simulation is not None
        with subprocess.Popen(
            [ROOT / "ws", *words], cwd=self.folder, env=self.environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
        ) as node:  # fmt: skip
            assert node.stdout is not None
            bound = threading.Timer(LIMIT, os.killpg, (node.pid, signal.SIGKILL))
            bound.start()
            lines = []
            for line in iter(node.stdout.readline, ""):
                lines.append(line)
                if "the policy moves the robot" in line:
                    os.killpg(node.pid, signal.SIGINT)
            bound.cancel()
            assert any("the robot is stopped" in line for line in lines), lines

    def end_simulation(self) -> None:
        if self.simulation is not None:
            os.killpg(self.simulation.pid, signal.SIGINT)
            self.simulation.communicate(timeout=LIMIT)
            self.simulation = None

    def run(self, words: list[str]) -> str:
        """What a command printed; it has to succeed."""
        done = run([ROOT / "ws", *words], cwd=self.folder, env=self.environment)
        told = f"{shlex.join(words)}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        assert done.returncode == 0 and "Traceback" not in done.stderr, told
        return done.stdout


@pytest.fixture
def reader(tmp_path: Path, environment: dict[str, str], monkeypatch, request) -> Iterator[Reader]:
    package = request.param
    checkout = tmp_path / "checkout"
    checkout.mkdir()
    monkeypatch.chdir(checkout)
    monkeypatch.syspath_prepend(tmp_path / package / "src")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}/{package}:{os.environ['ROS_PACKAGE_PATH']}")
    reader = Reader(checkout, environment, package)
    yield reader
    reader.end_simulation()


@pytest.mark.slow
@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize("reader", ["my_rover"], indirect=True)
def test_every_command_of_the_vehicle_works(reader: Reader) -> None:
    for block in blocks(VEHICLE):
        if block.language == "sh":
            reader.read(block)
    for place in ("my_rover.gif", "runs/my_rover/best.pt"):
        assert (reader.folder / place).is_file(), place


@pytest.mark.slow
@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize("reader", ["my_arm"], indirect=True)
def test_every_command_works(reader: Reader) -> None:
    for block in blocks(ARM):
        reader.read(block)
    for place in ("my_arm.gif", "runs/my_arm/best.pt", "runs/tip/best.pt"):
        assert (reader.folder / place).is_file(), place


@pytest.mark.slow
@pytest.mark.parametrize("reader", ["my_arm"], indirect=True)
def test_every_test_of_the_page_passes(reader: Reader) -> None:
    for block in blocks(TESTS):
        reader.read(block)
