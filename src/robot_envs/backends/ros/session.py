"""The master, simulator and robots that a process's environments over ROS share."""

import atexit
import contextlib
import os
import re
from collections.abc import Sequence
from functools import partial

import rospy

from file_access.locks import scratch_folder
from robot_envs.backends.backend import RobotBackend, ticks_per_action
from robot_envs.backends.ros import node, running, windows
from robot_envs.backends.ros.bringup import Say, bring_up
from robot_envs.backends.ros.running import STEP_SERVICE, RunningSimulator, SharedWorld, Undo
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from ros_calls.service import TIMEOUT
from ros_utils import ros_gazebo

START_TIMEOUT = 60.0  # [s] for the simulator to come up

_sessions: "list[RosSession]" = []  # of this process, oldest first


class RosSession:
    """Starts master, simulator, robots and controllers where they don't run; `close` ends what it started.

    Once started it is the process's session: environments of these robots that are made with the backend
    "ros" ("ros-realtime" if `realtime`) use it.

    Args:
        robots: The robot, or several that share a world.
        name: This process's node name, with namespace.
        argv: The process's arguments, with roslaunch's remappings.
        realtime: Let the world run in real time, instead of in lock-step.
        gui: Open the simulator's window, if it isn't open.
        seed: Seed of a simulator that is started here.
        rviz: Show the robot in RViz.
    """

    def __init__(
        self, robots: Robot | Sequence[Robot], name: str, argv: list[str], realtime: bool, gui: bool,
        seed: int, rviz: bool = False,
    ) -> None:  # fmt: skip
        self._scene = Scene([robots] if isinstance(robots, Robot) else robots)
        self._world = SharedWorld()
        self._name, self._argv = name, argv
        self._realtime, self._gui, self._seed = realtime, gui, seed
        self._rviz = rviz
        self._undo = contextlib.ExitStack()
        # Outlives the world, since a process can become a node only once.
        self._node = contextlib.ExitStack()
        self._started_simulator = False

    def start(self, say: Say) -> None:
        """Starts missing parts, which `say` reports, and makes this the process's session.

        Raises RobotEnvError if something can't be started, or what runs doesn't fit; `close` ends the rest.
        """
        robot = self._scene.robots[0]
        if rospy.core.is_initialized() and rospy.is_shutdown():
            raise RobotEnvError(
                "this process's ROS node has ended, and a process becomes one only once; keep a "
                "session until the end, or begin another process"
            )
        if self._rviz:
            windows.check_rviz(robot)
        self._started_simulator = not (node.master_is_up() and running.simulator_answers())
        if self._started_simulator:
            say("starting the simulator")
            self._start_simulator()
        if not rospy.core.is_initialized():  # the training handles signals itself
            node.refuse_twin(self._name)
            own = os.path.basename(self._name)
            rospy.init_node(own, argv=["", *self._argv], disable_signals=True)
            self._node.callback(rospy.signal_shutdown, "training ended")
        self._check_mode()
        running.check_world(robot)
        if robot.physics_step:
            restore = partial(running.physics_step, running.physics_step())
            self._undo.callback(_undo_if_running, RunningSimulator(), restore)
            running.physics_step(robot.physics_step)
        changes = bring_up(self._scene, say)
        if not self._started_simulator:  # otherwise it ends with all that is in it
            before = RunningSimulator()
            for undo in (*changes, lambda: self._world.place_objects(())):
                self._undo.callback(_undo_if_running, before, undo)
        if self._gui:
            self._show_window(say)
        if self._rviz:
            say("opening RViz")
            self._undo.callback(windows.open_rviz(robot))
        _sessions.append(self)
        self._undo.callback(_sessions.remove, self)

    def _start_simulator(self) -> None:
        """Starts the simulator, and the master if there is none."""
        folder = self._undo.enter_context(scratch_folder())
        started = ros_gazebo.launch_Gazebo(
            paused=True, gui=self._gui, output="log", launch_new_term=False,
            custom_world_path=running.world_path(self._scene.robots[0].world, folder),
            lockstep=not self._realtime, seed=self._seed, timeout=START_TIMEOUT,
        )  # fmt: skip
        if isinstance(started, bool):
            raise RobotEnvError("the simulator didn't start; see the messages above")
        before = RunningSimulator()

        def end() -> None:
            if started.pid is not None and before.is_registered():
                ros_gazebo.close_Gazebo()
            else:  # another simulator has taken its name, and isn't ours to end
                started.close()

        self._undo.callback(end)

    def _check_mode(self) -> None:
        """Raises RobotEnvError if the running simulator doesn't move as the environments need it."""
        lockstep = node.service_is_registered(STEP_SERVICE)
        if self._realtime and lockstep:
            raise RobotEnvError(
                f"the running simulator moves in lock-step (it has {STEP_SERVICE}): its time would stand "
                "still; train without --realtime, or start it with lockstep:=false"
            )
        if not self._realtime and not lockstep:
            raise RobotEnvError(
                f"the running simulator has no {STEP_SERVICE}: start it with lockstep:=true "
                "(roslaunch gazebo_ros empty_world.launch takes it), or train with --realtime"
            )

    def _show_window(self, say: Say) -> None:
        if self._started_simulator:
            windows.report_opening(say, registered=False)
        elif windows.is_open():
            windows.report_open(say)
        else:
            self._undo.callback(windows.open_window(say))
            windows.report_opening(say, registered=True)

    def connect(self, scene: Scene, control_period: float, deadline: float | None = None) -> RobotBackend:
        """Makes a backend that moves the robots; the caller closes it. See `make_backend`."""
        ticks = ticks_per_action(control_period, running.physics_step()) if control_period else 0
        if self._realtime:
            from robot_envs.backends.ros.realtime import RealtimeWorld

            return RealtimeWorld(scene, control_period, self._world)
        from robot_envs.backends.ros.lockstep import LockstepWorld

        return LockstepWorld(scene, ticks, self._world, deadline or TIMEOUT)

    def make_room(self) -> None:
        """Ends what `start` started, except the node; raises RobotEnvError while an environment uses it."""
        if self._world.is_used:
            raise RobotEnvError(
                "over ROS a process moves one world at a time, and an environment of "
                f"'{self._scene.robots[0].model}' is open; close() it first, or put several robots into "
                "one world: RobotEnv([first, second], task)"
            )
        self._undo.close()

    def close(self) -> None:
        """Ends what `start` started; may be called twice."""
        try:
            self._undo.close()
        finally:
            self._node.close()


def running_session(scene: Scene, realtime: bool) -> RosSession:
    """Returns the process's session, started if there is none; it runs until the process ends.

    If its simulator has died, another one is started. A session of other robots ends; raises RobotEnvError if
    an environment of these is open.
    """
    for session in reversed(_sessions[:]):
        answers, has_them = running.simulator_answers(), session._scene.robots == scene.robots
        if has_them and session._realtime == realtime:
            if answers:
                return session
            break
        if answers and not has_them:
            session.make_room()
    model = re.sub(r"\W", "_", scene.robots[0].model, flags=re.ASCII).strip("_") or "robot"
    name = f"/{model}_env_{os.getpid()}"
    session = RosSession(scene.robots, name, [], realtime=realtime, gui=False, seed=0)
    try:
        session.start(rospy.loginfo)
    except BaseException:  # Ctrl-C, too
        session.close()
        raise
    atexit.register(session.close)
    return session


def _undo_if_running(before: RunningSimulator, undo: Undo) -> None:
    """Undoes a change, unless the simulator has died meanwhile or was replaced."""
    with contextlib.suppress(RobotEnvError, rospy.ServiceException, rospy.ROSException, OSError):
        if before.is_registered() and running.simulator_answers():
            undo()
