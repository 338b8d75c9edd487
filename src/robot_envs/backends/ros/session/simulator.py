"""The simulator of a session: started where none answers, checked where one runs."""

import contextlib
import os
from tempfile import NamedTemporaryFile

import rospy

from robot_envs.backends.ros import node
from robot_envs.backends.ros.bringup import world
from robot_envs.backends.ros.bringup.world import STEP_SERVICE, Undo, world_path
from robot_envs.backends.ros.running_simulator import RunningSimulator
from robot_envs.description.files import Source
from robot_envs.errors import RobotEnvError
from ros_utils import ros_gazebo

START_TIMEOUT = 60.0  # [s] for the simulator to come up


def answers() -> bool:
    """Whether there is one, at a master that is there.

    Raises:
        RobotEnvError: if the master or the simulator hangs.
    """
    return node.master_is_up() and world.simulator_answers()


def start(
    source: Source | None, *, lockstep: bool, gui: bool, seed: int, undo: contextlib.ExitStack
) -> None:
    """Starts one, and the master where there is none.

    Args:
        source: of its world, as a robot has it.
        lockstep: whether time moves by steps alone.
        gui: with a window.
        seed: of random numbers that plugins draw.
        undo: takes what ends it.

    Raises:
        RobotEnvError: if it doesn't start.
    """

    def write(text: str) -> str:
        with NamedTemporaryFile("w", suffix=".world", delete=False) as file:
            file.write(text)
        undo.callback(os.unlink, file.name)
        return file.name

    started = ros_gazebo.launch_Gazebo(
        paused=True, gui=gui, output="log", launch_new_term=False,
        custom_world_path=world_path(source, write),
        lockstep=lockstep, seed=seed, timeout=START_TIMEOUT,
    )  # fmt: skip
    if isinstance(started, bool):
        raise RobotEnvError("the simulator didn't start; see the messages above")
    running = RunningSimulator()

    def end() -> None:
        """One that has taken its place meanwhile is somebody else's."""
        if started.pid is not None and running.is_there():
            ros_gazebo.close_Gazebo()
        else:
            started.close()

    undo.callback(end)


def check_mode(realtime: bool) -> None:
    """Makes sure that the one that runs moves as the session's environments need it.

    Raises:
        RobotEnvError: if it doesn't.
    """
    lockstep = node.service_is_registered(STEP_SERVICE)
    if realtime and lockstep:
        raise RobotEnvError(
            f"the running simulator moves in lock-step (it has {STEP_SERVICE}): its time would stand "
            "still; train without --realtime, or start it with lockstep:=false"
        )
    if not realtime and not lockstep:
        raise RobotEnvError(
            f"the running simulator has no {STEP_SERVICE}: start it with lockstep:=true "
            "(roslaunch gazebo_ros empty_world.launch takes it), or train with --realtime"
        )


def undo_there(running: RunningSimulator, undo: Undo) -> None:
    """Undoes a change at a simulator that may have died meanwhile, or made place for another one."""
    with contextlib.suppress(RobotEnvError, rospy.ServiceException, rospy.ROSException, OSError):
        if running.is_there() and world.simulator_answers():
            undo()
