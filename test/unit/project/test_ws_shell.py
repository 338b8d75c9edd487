"""`ws shell` at a terminal: roscd and its family, completion, the user's ~/.bashrc."""

import os
import pty
import re
import select
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

BOUND = 120.0  # [s] without a sign of life
ESCAPES = re.compile(rb"\x1b\[[0-9;?]*[A-Za-z]|\r|\a")
BASHRC = """
export THEIRS="of the user" PATH="$HOME/bin:$PATH" ROS_PACKAGE_PATH=/elsewhere PYTHONPATH=/elsewhere
export ROS_ROOT=/elsewhere VIRTUAL_ENV=/elsewhere
alias greet='echo hello'
PS1='user> '
"""


class Terminal:
    """An interactive shell at a terminal."""

    def __init__(self, command: list[str], environment: dict[str, str], folder: Path) -> None:
        self._master, slave = pty.openpty()
        self.process = subprocess.Popen(
            command, stdin=slave, stdout=slave, stderr=slave, env=environment, cwd=folder,
            start_new_session=True,
        )  # fmt: skip
        os.close(slave)
        self._count = 0
        self.until("user> ")

    def until(self, text: str) -> str:
        """What comes up to a text, and the text."""
        seen = b""
        while text.encode() not in ESCAPES.sub(b"", seen):
            ready, _, _ = select.select([self._master], [], [], BOUND)
            assert ready, f"no {text!r} in {seen.decode()}"
            seen += os.read(self._master, 4096)
        return ESCAPES.sub(b"", seen).decode()

    def type(self, line: str) -> str:
        """Types a line, with TAB as a key; returns what it prints.

        A second command tells the end, in a word that isn't in what is typed.
        """
        self._count += 1
        os.write(self._master, f"{line}\necho end''of{self._count}\n".encode())
        return self.until(f"endof{self._count}")

    def close(self) -> None:
        os.close(self._master)
        self.process.wait(BOUND)


@pytest.fixture(scope="module")
def typed(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], str]]:
    home = tmp_path_factory.mktemp("home")
    (home / ".bashrc").write_text(BASHRC)
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(home), "TERM": "dumb", "PYTHONPATH": "/x"}
    terminal = Terminal([str(root / "ws"), "shell"], environment, root)
    yield terminal.type
    terminal.close()


def test_the_users_own_settings_are_read(typed: Callable[[str], str]) -> None:
    printed = typed('greet; echo "$THEIRS"')
    assert "hello\n" in printed
    assert "of the user\n" in printed
    assert "(cartpole) user> " in printed + typed("true")


def test_the_workspace_wins(typed: Callable[[str], str], root: Path) -> None:
    printed = typed("type -P python3; rospack find gazebo_ros; python3 -c 'import rospy, cartpole'")
    assert ".ws/venv/bin/python3\n" in printed
    assert ".ws/src/gazebo_ros\n" in printed
    assert "Error" not in printed
    assert "/elsewhere" not in typed("env | grep -v HOME")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("roscd gazebo_ros && pwd; cd -", ".ws/src/gazebo_ros\n"),
        ("EDITOR=echo; rosed gazebo_ros empty_world.launch", "launch/empty_world.launch\n"),
        ("roscd gazebo_r\t && pwd; cd -", ".ws/src/gazebo_ros\n"),
        ("rosrun cartpole pg_train.\t --help", "usage: pg_train.py"),
        ("roslaunch gazebo_ros empty_world.launch lockst\t --files", "lockstep"),
        ("rostopic ec\t --help", "rostopic echo"),
        ("./ws check typ\tnonsense", "check types nonsense"),
        ("./ws xacr\t --help", "xacro"),
    ],
)
def test_ros_commands_and_completion(typed: Callable[[str], str], line: str, expected: str) -> None:
    assert expected in typed(line)
