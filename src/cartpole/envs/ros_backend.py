"""Environments over ROS: all of a process share one node, one simulator and one robot."""

import atexit
import os
from functools import lru_cache

import rospy

from cartpole.envs import ros_robot
from cartpole.envs.plant import Plant, ticks_per_action
from cartpole.envs.ros_plants import LockstepPlant, RealtimePlant
from cartpole.envs.ros_session import RosSession
from cartpole.errors import CartpoleError
from cartpole.task import TASKS
from ros_utils import ros_gazebo

HEIGHT = max(task.stand_height for task in TASKS.values())  # [m]; a robot there can do every task


def ros_plant(realtime: bool, control_period: float, height: float) -> Plant:
    """Connects to the robot in a simulator; brings up what isn't running.

    What is started here runs until this process ends; where it has died, it is started anew.

    Args:
        realtime: whether the world runs by itself, instead of in lock-step.
        control_period: simulated time [s] of one action.
        height: the least that the robot's stand must be above the ground [m].

    Raises:
        ValueError: if the period isn't a whole number of physics steps.
        CartpoleError: if something can't be started, or what runs doesn't fit.
    """
    ticks_per_action(control_period)  # before a simulator is started for it
    _session(realtime)
    if not ros_robot.simulator_answers():
        _session.cache_clear()  # the old session still ends, with this process, what is left of it
        _session(realtime)
    ros_robot.check_height(height)
    ticks = ticks_per_action(control_period, _physics_step())
    return RealtimePlant(control_period) if realtime else LockstepPlant(ticks)


@lru_cache(maxsize=2)
def _session(realtime: bool) -> RosSession:
    """The process's own, since a process can become a ROS node only once."""
    name = f"/cartpole_env_{os.getpid()}"
    session = RosSession(name, [], realtime=realtime, gui=False, seed=0, height=HEIGHT)
    try:
        session.start(rospy.loginfo).close()
    except BaseException:  # Ctrl-C, too: nothing that was started may stay behind
        session.close()
        raise
    atexit.register(session.close)
    return session


def _physics_step() -> float:
    """The simulator's [s]."""
    step = ros_gazebo.gazebo_get_time_step()
    if not step > 0.0:
        raise CartpoleError("the simulator doesn't tell its time step; see the messages above")
    return step
