"""The process of a simulator's keeper: how it is started, ended, and what its end means."""

import contextlib
import io
import os
import secrets
import signal
import subprocess
import sys
from pathlib import Path

import rospkg

import bullet_gazebo
from robot_envs.errors import RobotEnvError

KEEPER = Path(__file__).with_name("keeper.py")
OURS = Path(bullet_gazebo.__file__).parents[1]
LOOPBACK = "127.0.0.1"
# Of the client, which would have processes of ours look for it elsewhere, or be another name.
NOT_OURS = ("ROS_HOSTNAME", "ROS_IPV6", "ROS_NAMESPACE")


def log_folder() -> Path:
    """A new folder for the logs of one simulator.

    Raises:
        RobotEnvError: if there can't be one.
    """
    folder = Path(rospkg.get_log_dir(), "robot_envs", f"{os.getpid()}-{secrets.token_hex(4)}")
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise RobotEnvError(
            f"{folder}: {error.strerror}: set ROS_LOG_DIR to a folder that can be written"
        ) from error
    return folder


def spawned(arguments: list[str], path: Path) -> "tuple[subprocess.Popen[bytes], io.FileIO]":
    """Starts a keeper, whose output goes to a file; returns what it reports to, too."""
    with contextlib.ExitStack() as stack:
        log = stack.enter_context(path.open("wb"))
        reading, telling = os.pipe()
        stack.callback(os.close, telling)
        report = io.FileIO(reading)
        try:
            process = subprocess.Popen(
                [sys.executable, "-P", str(KEEPER), str(os.getpid()), str(telling), *arguments],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=_environment(path.parent),
                pass_fds=(telling,), start_new_session=True,
            )  # fmt: skip
        except BaseException:
            report.close()
            raise
        return process, report


def _environment(folder: Path) -> dict[str, str]:
    """Ours, with our Python and this library, for a master and a node on loopback.

    What else this process imports from isn't theirs: catkin's packages add to it as they are imported.
    """
    kept = {name: value for name, value in os.environ.items() if name not in NOT_OURS}
    return kept | {
        "PATH": os.pathsep.join([os.path.dirname(sys.executable), kept.get("PATH", os.defpath)]),
        "PYTHONPATH": os.pathsep.join(filter(None, [kept.get("PYTHONPATH"), str(OURS)])),
        "PYTHONUNBUFFERED": "1",
        "ROS_IP": LOOPBACK,
        "ROS_LOG_DIR": str(folder),
    }


def kill(process: "subprocess.Popen[bytes]") -> None:
    """Ends a keeper and all of its session."""
    if process.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def end_of(code: int) -> str:
    """How a keeper's end is to be read."""
    number = code - 128 if code > 128 else -code
    if number <= 0:
        return f"it ended with exit code {code}"
    with contextlib.suppress(ValueError):
        name = signal.Signals(number).name
        more = ", as the kernel does where memory runs out" if name == "SIGKILL" else ""
        return f"it was ended by {name}{more}"
    return f"it ended with exit code {code}"
