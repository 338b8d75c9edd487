"""The simulator that all tests of a process share, and recordings of those that fail."""

import contextlib
import functools
import os
import re
import shlex
import shutil
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import rosgraph
import rospkg

from ros_calls import master
from ros_calls.waiting import wait_until
from ros_utils import ros_gazebo, ros_node
from ros_utils._internal import roslaunch
from ros_utils._internal.programs import Started
from ros_utils.simulation import LOOPBACK, reserved_port
from ros_utils.testing.followed_node import SIMULATOR, WorldError
from ros_utils.testing.robot_world import RobotWorld

FAILURES = "ROS_TEST_FAILURES"  # environment variable: the folder of what failed tests leave
STARTING = 120.0  # [s of wall time]
DRAWING = 120.0  # [s of wall time] to complete a recording
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")  # of an object
PICTURE, BAG = "world.png", "world.bag"


def failure_folder(test: str) -> Path:
    """Makes an empty folder for what a failed test leaves, and returns it."""
    parent = Path(os.environ.get(FAILURES) or Path(rospkg.get_ros_home(), "test_failures"))
    plain = test.replace("::", "-").replace("/", "-")
    name = re.sub(r"[^A-Za-z0-9_.-]+", "-", plain)
    if name != plain:  # so that `test[<]` and `test[>]` have a folder each
        name = f"{name.strip('-')}-{zlib.crc32(test.encode()):08x}"
    folder = parent.absolute() / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def tell(folder: Path, seed: int, failure: str, message: str, again: str) -> str:
    """Writes the failure and the seed beside the recording, and returns what to say about it.

    `message` is the failure in one line, `again` that of the second, recorded run; empty if it passed.
    """
    folders = filter(None, os.environ.get("CARTPOLE_WITH", "").split(":"))
    ws = [f"--with {shlex.quote(each)}" for each in folders]
    if ws or "CARTPOLE_WS_MASTER" in os.environ:
        ws.insert(0, "./ws")
    replay = " ".join([*ws, "rosrun cartpole replay.py", shlex.quote(str(folder / BAG))])
    text = f"recorded in {folder}\nreplayed by: {replay}\n"
    text += f"the page of that moment, to step on: {replay} --gui"
    if _ADDRESS.sub("", again) != _ADDRESS.sub("", message):
        how = f"fails otherwise ({again})" if again else "passes"
        text = f"it {how} when it runs once more: it isn't repeatable; that run is {text}"
    (folder / "failure.txt").write_text(f"seed: {seed}\n{text}\n\n{failure}\n", encoding="utf-8")
    return text


class Bench:
    """A master and a simulator in lock-step, which is emptied before each test.

    A process that roslaunch has started, as rostest does, keeps its master; any other gets one of its own,
    which ROS_MASTER_URI names from then on. So rospy, which knows one master a process, works in tests.
    """

    def __init__(self) -> None:
        self._simulator: Started | None = None
        # gazebo_msgs/GetPhysicsProperties, of a simulator that has just started
        self._physics: Any = None
        if "__name" not in rosgraph.names.load_mappings(sys.argv):
            os.environ["ROS_MASTER_URI"] = f"http://{LOOPBACK}:{reserved_port()}"
            os.environ["ROS_IP"] = LOOPBACK
            if not roslaunch.start_master(window=False, timeout=STARTING):
                raise WorldError(f"no ROS master could be started at {master.uri()}; the log says why")

    @contextlib.contextmanager
    def world(self, seed: int, recorded: Path | None = None) -> Iterator[RobotWorld]:
        """Yields an empty world at time 0, recorded in a folder: a picture and a bag."""
        if seed < 1:
            raise WorldError(f"the seed is {seed}: 1 or more is needed")
        with contextlib.ExitStack() as ending:
            if recorded is None:
                if self._simulator is None or not self._simulator.running:
                    self._simulator = self._launch()
            else:
                self._end_simulator()
                ending.callback(self._end_simulator)
                self._simulator = self._launch(recorded)
                ending.callback(_await_recordings, recorded)
            before = _parameters()
            ending.callback(_forget_parameters, before)
            usual = self._physics
            gravity = usual.gravity.x, usual.gravity.y, usual.gravity.z
            properties = usual.time_step, usual.max_update_rate, gravity, usual.ode_config
            ros_gazebo.gazebo_set_physics_properties(*properties)
            ros_gazebo.gazebo_unpause_physics()
            world = RobotWorld(seed)
            ending.callback(world.close)
            yield world

    def _launch(self, recorded: Path | None = None) -> Started:
        log, more = None, ""
        if recorded is not None:
            log = str(recorded / "simulator.log")
            more = f"--journal '{recorded / BAG}' --video '{recorded / PICTURE}'"
        started = ros_gazebo.launch_Gazebo(
            gui=False, launch_new_term=False, lockstep=True, server_required=True, timeout=STARTING,
            output="screen" if log else "log", log_file=log,
            extra_gazebo_args=more,
        )  # fmt: skip
        if not isinstance(started, Started):
            raise WorldError(f"no simulator at {master.uri()}; the log says why")
        self._physics = ros_gazebo.gazebo_get_physics_properties()
        return started

    def _end_simulator(self) -> None:
        if self._simulator is not None:
            self._simulator.close()
        self._simulator = None


@functools.cache
def process_bench() -> Bench:
    """Returns the bench of this process; its programs end with the process."""
    return Bench()


def _parameters() -> set[str]:
    return set(master.call("getParamNames"))


def _forget_parameters(before: set[str]) -> None:
    """Deletes the parameters that a test has set."""
    for name in _parameters() - before:
        with contextlib.suppress(master.Refused):
            master.call("deleteParam", name)


def _await_recordings(folder: Path) -> None:
    """Ends the simulator, and waits until it has completed the bag, and another process the picture."""
    ros_node.ros_kill_node(SIMULATOR)
    log, drawn = folder / "simulator.log", f"recording: {folder / PICTURE}:"

    def look() -> bool:
        text = log.read_text(encoding="utf-8", errors="replace")
        return drawn in text and (folder / BAG).exists()

    wait_until(look, DRAWING, "recording")
