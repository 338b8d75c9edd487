"""A simulator with a master of its own, for one client alone, under a supervisor process."""

import contextlib
import os
import secrets
import select
import signal
import subprocess
import sys
import time
import weakref
from pathlib import Path

import rospkg

import bullet_gazebo
from robot_envs.backends.backend import Slot
from robot_envs.backends.ros.running import world_path
from robot_envs.errors import RobotEnvError, SimulatorFault, SimulatorHangs
from robot_envs.files import Source
from ros_calls import master
from ros_calls.waiting import POLL, service_answers

ANSWERING = "/gazebo/pause_physics"  # the last service that a client needs before it can begin
NOTICING = 2.0  # [s] for a supervisor to notice that its simulator has died
ENDING = 10.0  # [s] for all processes to end after SIGTERM
STARTING = 60.0  # [s] for one simulator to come up
ONE_MORE = 15.0  # [s] for each that starts at the same time
SUPERVISOR = Path(__file__).with_name("supervisor.py")
SOURCES = Path(bullet_gazebo.__file__).parents[1]
# The client's own settings, which would give these processes another name or address.
NOT_INHERITED = ("ROS_HOSTNAME", "ROS_IPV6", "ROS_NAMESPACE")


class OwnSimulator:
    """Master and simulator on loopback, in lock-step; they end with this process in any case.

    The constructor only starts them, or raises RobotEnvError; `wait` returns once they can be used. `slot` is
    its place among those that start together, `world` the robot's world file or its text, `seed` that of
    random numbers that plugins draw, and `renderer` draws cameras' pictures.
    """

    def __init__(self, slot: Slot, world: Source | None, seed: int, renderer: str = "rays") -> None:
        self.slot = slot
        self.uri = ""  # the master's address, once it is known
        self.pid: int | None = None  # the simulator's process
        self._owner = os.getpid()
        folder = _log_folder()
        self.log = folder / "simulator.log"
        arguments = ["-u", "--lockstep", "--seed", str(seed), "--renderer", renderer, "__name:=gazebo",
                     f"__log:={folder / 'node.log'}", "_pub_clock_frequency:=100"]  # fmt: skip

        try:
            self._process = _start([*arguments, *filter(None, [world_path(world, folder)])], self.log)
        except OSError as error:
            raise RobotEnvError(f"{slot} can't be started: {error.strerror}") from error
        self._started = time.monotonic()
        # Kills a simulator that was dropped without `close`, or is open when this process exits.
        self._finalizer = weakref.finalize(self, _kill, self._process, self._owner)

    def __str__(self) -> str:
        return f"{self.slot} (master {self.uri})" if self.uri else str(self.slot)

    @property
    def is_alive(self) -> bool:
        """Whether its processes run."""
        return self._process.poll() is None

    @property
    def gave_up(self) -> bool:
        """Whether it has exited by itself with an error; another one would do the same."""
        return self._process.poll() in range(1, 128)

    def has_ended(self, timeout: float = NOTICING) -> bool:
        """Returns whether it ends within a time [s], by default that which the supervisor takes to notice."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout)
        return not self.is_alive

    def wait(self) -> None:
        """Returns once it answers; raises SimulatorFault if it ends instead, or doesn't answer in time."""
        patience = STARTING + ONE_MORE * (self.slot.of - 1)
        deadline = self._started + patience
        if not self.uri:
            self._read_report(deadline)
        with master.using(self.uri):
            while not service_answers(ANSWERING):
                if not self.is_alive:
                    raise SimulatorFault("it ended before it was ready")
                if time.monotonic() > deadline:
                    raise SimulatorHangs(f"it wasn't ready within {patience:g} s")
                time.sleep(POLL)

    def _read_report(self, deadline: float) -> None:
        """Waits for the master's address and the simulator's process id."""
        report, poll = self._process.stdout, select.poll()
        assert report is not None
        poll.register(report, select.POLLIN)
        timeout = 1000.0 * max(0.0, deadline - time.monotonic())
        words = report.readline().split() if poll.poll(timeout) else []
        if len(words) != 2:
            raise SimulatorFault("its master didn't start")
        self.uri, self.pid = words[0], int(words[1])

    def terminate(self) -> None:
        """Asks it to end, and returns at once."""
        if os.getpid() == self._owner and self.is_alive:
            self._process.terminate()

    def join(self) -> None:
        """Waits for the end after `terminate`, then kills the rest; may be called twice."""
        if os.getpid() == self._owner:  # a forked child must not end its parent's simulator
            self.has_ended(ENDING)
            self._finalizer()

    def post_mortem(self, hangs: bool) -> str:
        """Kills a simulator that has failed; returns how it ended, unless it hangs, and its last words."""
        how = ""
        if not hangs and self.has_ended():
            how = f"{_exit_reason(self._process.returncode)}, "
        self._finalizer()
        try:
            lines = self.log.read_text(encoding="utf-8", errors="replace").split("\n")
        except OSError as error:
            lines = [str(error.strerror)]
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        said = f"it said last '{last}'" if last else "it said nothing"
        return f"{how}{said} (log: {self.log})"


def _log_folder() -> Path:
    folder = Path(rospkg.get_log_dir(), "robot_envs", f"{os.getpid()}-{secrets.token_hex(4)}")
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        hint = "set ROS_LOG_DIR to a folder that can be written"
        raise RobotEnvError(f"{folder}: {error.strerror}: {hint}") from error
    return folder


def _start(arguments: list[str], log: Path) -> subprocess.Popen[str]:
    """Starts a supervisor, whose output goes to a log, but for its report on standard output."""
    # This process's sys.path isn't inherited: importing catkin's packages adds to it.
    kept = {name: value for name, value in os.environ.items() if name not in NOT_INHERITED}
    environment = kept | {
        "PATH": os.pathsep.join([os.path.dirname(sys.executable), kept.get("PATH", os.defpath)]),
        "PYTHONPATH": os.pathsep.join(filter(None, [kept.get("PYTHONPATH"), str(SOURCES)])),
        "PYTHONUNBUFFERED": "1",
        "ROS_IP": "127.0.0.1",
        "ROS_LOG_DIR": str(log.parent),
    }
    with log.open("wb") as output:
        return subprocess.Popen(
            [sys.executable, "-P", str(SUPERVISOR), str(os.getpid()), *arguments],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=output, env=environment,
            start_new_session=True, text=True,
        )  # fmt: skip


def _kill(supervisor: subprocess.Popen[str], owner: int) -> None:
    """Kills a supervisor and its session, unless a forked child asks."""
    if os.getpid() != owner:
        return
    if supervisor.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(supervisor.pid, signal.SIGKILL)
        supervisor.wait()
    assert supervisor.stdout is not None
    supervisor.stdout.close()


def _exit_reason(code: int) -> str:
    number = code - 128 if code > 128 else -code
    with contextlib.suppress(ValueError):
        name = signal.Signals(number).name
        more = ", as the kernel does where memory runs out" if name == "SIGKILL" else ""
        return f"it was ended by {name}{more}"
    return f"it ended with exit code {code}"
