"""A simulator with a master of its own, for one client alone, under a supervisor process."""

import contextlib
import io
import os
import secrets
import select
import signal
import subprocess
import sys
import time
import weakref
from pathlib import Path

import psutil
import rospkg

import bullet_gazebo
from robot_envs.backends.backend import Slot
from robot_envs.backends.ros.running import world_path
from robot_envs.errors import RobotEnvError, SimulatorFault, SimulatorHangs
from robot_envs.files import Source
from ros_calls import master
from ros_calls.waiting import POLL, service_answers

MEMORY = 120_000_000  # [bytes] of a master and a simulator with a robot, without pages shared with others
ANSWERING = "/gazebo/pause_physics"  # the last service that a client needs before it can begin
NOTICING = 2.0  # [s] for a supervisor to notice that its simulator has died
ENDING = 10.0  # [s] for all processes to end after SIGTERM
STARTING = 60.0  # [s] for one simulator to come up
ONE_MORE = 15.0  # [s] for each that starts at the same time
SUPERVISOR = Path(__file__).with_name("supervisor.py")
SOURCES = Path(bullet_gazebo.__file__).parents[1]
# The client's own settings, which would give these processes another name or address.
NOT_INHERITED = ("ROS_HOSTNAME", "ROS_IPV6", "ROS_NAMESPACE")


def check_memory(count: int) -> None:
    """Raises RobotEnvError if there isn't the memory for so many simulators."""
    needed, free = count * MEMORY, psutil.virtual_memory().available
    if needed > free:
        raise RobotEnvError(
            f"{count} simulators need about {needed / 1e9:.1f} GB of memory, and {free / 1e9:.1f} GB are "
            'free: make fewer environments, or make them in this process (backend="bullet"), where each '
            "needs a fraction"
        )


class OwnSimulator:
    """Master and simulator on loopback, in lock-step; they end with this process in any case.

    The constructor only starts them; `wait` returns once they can be used.

    Args:
        slot: Its place among the simulators that start together.
        world: The robot's world file, or its text, which is written next to the log.
        seed: Of random numbers that plugins draw.
        renderer: Of cameras' pictures.

    Raises:
        RobotEnvError: If no process can be started.
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
            path = world_path(world, folder)
            self._process, self._report = _start([*arguments, *filter(None, [path])], self.log)
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

    def has_died(self) -> bool:
        """Returns whether it has died; gives the supervisor time to notice."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(NOTICING)
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
        poll = select.poll()
        poll.register(self._report, select.POLLIN)
        poll.poll(1000.0 * max(0.0, deadline - time.monotonic()))
        words = self._report.readline().decode().split() if poll.poll(0) else []
        if len(words) != 2:
            raise SimulatorFault("its master didn't start")
        self.uri, self.pid = words[0], int(words[1])

    def terminate(self) -> None:
        """Asks it to end, and returns at once."""
        if os.getpid() == self._owner and self.is_alive:
            self._process.terminate()

    def join(self) -> None:
        """Waits for the end after `terminate`, then kills the rest; may be called twice."""
        if os.getpid() != self._owner:  # a forked child must not end its parent's simulator
            return
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(ENDING)
        self._finalizer()
        self._report.close()

    def post_mortem(self, hangs: bool) -> str:
        """Kills a simulator that has failed; returns how it ended, and the last line of its log.

        Args:
            hangs: Whether it hangs, and so won't end by itself.
        """
        how = ""
        if not hangs and self.has_died():
            how = f"{_exit_reason(self._process.returncode)}, "
        self._finalizer()
        self._report.close()
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


def _start(arguments: list[str], log: Path) -> "tuple[subprocess.Popen[bytes], io.FileIO]":
    """Starts a supervisor, which writes to a log; returns it, and the pipe to which it reports."""
    # This process's sys.path isn't inherited: importing catkin's packages adds to it.
    kept = {name: value for name, value in os.environ.items() if name not in NOT_INHERITED}
    environment = kept | {
        "PATH": os.pathsep.join([os.path.dirname(sys.executable), kept.get("PATH", os.defpath)]),
        "PYTHONPATH": os.pathsep.join(filter(None, [kept.get("PYTHONPATH"), str(SOURCES)])),
        "PYTHONUNBUFFERED": "1",
        "ROS_IP": "127.0.0.1",
        "ROS_LOG_DIR": str(log.parent),
    }
    with contextlib.ExitStack() as stack:
        output = stack.enter_context(log.open("wb"))
        reading, writing = os.pipe()
        stack.callback(os.close, writing)
        report = io.FileIO(reading)
        try:
            process = subprocess.Popen(
                [sys.executable, "-P", str(SUPERVISOR), str(os.getpid()), str(writing), *arguments],
                stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=environment,
                pass_fds=(writing,), start_new_session=True,
            )  # fmt: skip
        except BaseException:
            report.close()
            raise
        return process, report


def _kill(supervisor: "subprocess.Popen[bytes]", owner: int) -> None:
    """Kills a supervisor and its session, unless a forked child asks."""
    if os.getpid() == owner and supervisor.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(supervisor.pid, signal.SIGKILL)
        supervisor.wait()


def _exit_reason(code: int) -> str:
    number = code - 128 if code > 128 else -code
    with contextlib.suppress(ValueError):
        name = signal.Signals(number).name
        more = ", as the kernel does where memory runs out" if name == "SIGKILL" else ""
        return f"it was ended by {name}{more}"
    return f"it ended with exit code {code}"
