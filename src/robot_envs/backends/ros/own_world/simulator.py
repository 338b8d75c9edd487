"""A simulator under a master of its own, for one client alone."""

import atexit
import contextlib
import os
import select
import subprocess
import time
import weakref
from functools import lru_cache

from robot_envs.backends.ros.bringup.world import world_path
from robot_envs.backends.ros.own_world import keeper_process
from robot_envs.backends.side_by_side import Place
from robot_envs.description.files import Source
from robot_envs.errors import RobotEnvError, SimulatorFault, SimulatorHangs
from ros_calls import master
from ros_calls.waiting import POLL, service_answers

ANSWERING = "/gazebo/pause_physics"  # the last thing that a client needs before it can begin
FALLING = 2.0  # [s] for a keeper to notice that its simulator has died
ENDING = 10.0  # [s] for all processes to end that were asked to
STARTING = 60.0  # [s] for one simulator to come up
ONE_MORE = 15.0  # [s] for each that starts beside it


class OwnSimulator:
    """Master and simulator on loopback, moving in lock-step; they end with this process in any case.

    It only begins to start; `wait` waits until it can be used.

    Args:
        place: which one it is of those that start together.
        world: what its world file is, as a robot has it; a text goes to a file beside the log.
        seed: of random numbers that plugins draw.

    Raises:
        RobotEnvError: if no process can be started.
    """

    def __init__(self, place: Place, world: Source | None, seed: int) -> None:
        self.place = place
        self.uri = ""  # the master's address, once it is known
        self.pid: int | None = None  # the simulator's process
        self._owner = os.getpid()
        folder = keeper_process.log_folder()
        self.log = folder / "simulator.log"
        arguments = ["-u", "--lockstep", "--seed", str(seed), "__name:=gazebo",
                     f"__log:={folder / 'node.log'}", "_pub_clock_frequency:=100"]  # fmt: skip

        def write(text: str) -> str:
            file = folder / "given.world"
            file.write_text(text, encoding="utf-8")
            return str(file)

        try:
            path = world_path(world, write)
            self._process, self._report = keeper_process.spawned(
                [*arguments, *filter(None, [path])], self.log
            )
        except OSError as error:
            raise RobotEnvError(f"{place} can't be started: {error.strerror}") from error
        self._begun = time.monotonic()
        self._dropped = weakref.finalize(self, _end_dropped, self._process, self._owner)
        self._dropped.atexit = False  # then all end together
        _living().add(self)

    def __str__(self) -> str:
        at = f" (master {self.uri})" if self.uri else ""
        return f"{self.place}{at}"

    @property
    def is_alive(self) -> bool:
        """Whether its processes run."""
        return self._process.poll() is None

    def falls(self) -> bool:
        """Whether it has died; its keeper notices that in a moment."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(FALLING)
        return not self.is_alive

    @property
    def gave_up(self) -> bool:
        """Whether it has ended by itself, for a reason of its own."""
        return self._process.poll() in range(1, 128)

    @property
    def processes(self) -> list[int]:
        """Ids of the simulator's and the master's."""
        return [*([self.pid] if self.pid else []), self._process.pid]

    def wait(self) -> None:
        """Returns once it answers.

        Raises:
            SimulatorFault: if it ends instead, or doesn't come in time.
        """
        patience = STARTING + ONE_MORE * (self.place.of - 1)
        deadline = self._begun + patience
        if not self.uri:
            self._hear(deadline)
        with master.using(self.uri):
            while not service_answers(ANSWERING):
                if not self.is_alive:
                    raise SimulatorFault("it ended before it was ready")
                if time.monotonic() > deadline:
                    raise SimulatorHangs(f"it wasn't ready within {patience:g} s")
                time.sleep(POLL)

    def _hear(self, deadline: float) -> None:
        """Waits for the address."""
        poll = select.poll()
        poll.register(self._report, select.POLLIN)
        poll.poll(1000.0 * max(0.0, deadline - time.monotonic()))
        told = self._report.readline().decode().split() if poll.poll(0) else []
        if len(told) != 2:
            raise SimulatorFault("its master didn't start")
        self.uri, self.pid = told[0], int(told[1])

    def begin_end(self) -> None:
        """Asks it to end, if it hasn't."""
        if os.getpid() == self._owner and self.is_alive:
            self._process.terminate()

    def end(self) -> None:
        """Waits for the end that was asked for, and insists on it; may be called twice."""
        if os.getpid() != self._owner:  # a forked child has inherited the object, not the duty
            return
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(ENDING)
        self._bury()

    def post_mortem(self, hangs: bool) -> str:
        """Ends one that has failed, and says how it ended, and what it has said last.

        Args:
            hangs: it won't end by itself.
        """
        try:
            self._process.wait(0.0 if hangs else FALLING)
            how = f"{keeper_process.end_of(self._process.returncode)}, "
        except subprocess.TimeoutExpired:
            how = ""
        self._bury()
        return f"{how}{self._last_line()}"

    def _bury(self) -> None:
        keeper_process.kill(self._process)
        self._dropped.detach()
        _living().discard(self)
        self._report.close()

    def close(self) -> None:
        """Asks it to end, and waits for it."""
        self.begin_end()
        self.end()

    def _last_line(self) -> str:
        """What it has said last, and where the rest stands."""
        try:
            lines = self.log.read_text(encoding="utf-8", errors="replace").split("\n")
        except OSError as error:
            lines = [str(error.strerror)]
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        said = f"it said last '{last}'" if last else "it said nothing"
        return f"{said} (log: {self.log})"


def _end_dropped(keeper: "subprocess.Popen[bytes]", owner: int) -> None:
    """Ends one that nobody has any more, and that wasn't closed."""
    if os.getpid() == owner:
        keeper_process.kill(keeper)


@lru_cache(maxsize=1)
def _living() -> "weakref.WeakSet[OwnSimulator]":
    """Those that this process has started and not ended; they end with it."""
    living: weakref.WeakSet[OwnSimulator] = weakref.WeakSet()
    atexit.register(_end_all, living)
    return living


def _end_all(living: "weakref.WeakSet[OwnSimulator]") -> None:
    those = list(living)
    for each in those:
        each.begin_end()
    for each in those:
        each.end()
