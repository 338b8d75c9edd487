"""Everything that environments over ROS need to be running: used where it runs, started where not."""

import atexit
import contextlib
import os
import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import rospy

from robot_envs.backends.backend import RobotBackend, ticks_per_action
from robot_envs.backends.ros import node
from robot_envs.backends.ros.bringup import world
from robot_envs.backends.ros.bringup.objects import Objects
from robot_envs.backends.ros.bringup.robots import Say, bring_up
from robot_envs.backends.ros.running_simulator import RunningSimulator
from robot_envs.backends.ros.session import simulator
from robot_envs.backends.ros.session.rviz import check_rviz, open_rviz
from robot_envs.backends.ros.session.window import (
    is_open,
    open_window,
    show_curves,
    tell_open,
    tell_opening,
)
from robot_envs.backends.ros.turn import Turn
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from ros_calls.service import TIMEOUT


class RosSession:
    """Brings up master, simulator, robot and controllers; `close()` ends just what it started.

    Once started it is the process's session: environments of this robot that are made with the
    backend "ros" ("ros-realtime" if `realtime`) use it and start nothing else.

    Args:
        robots: the robot, or several that share a world.
        name: this process's node name, with namespace.
        argv: the process's arguments, with roslaunch's remappings.
        realtime: let the world run by itself, instead of in lock-step.
        gui: open the simulator's window, if it isn't open.
        seed: for a simulator that is started here.
        rviz: show the robot in RViz, too.
        curves: a run folder, whose curves the window shows beside the robot, whoever opened it.
    """

    def __init__(
        self,
        robots: Robot | Sequence[Robot],
        name: str,
        argv: list[str],
        realtime: bool,
        gui: bool,
        seed: int,
        rviz: bool = False,
        curves: Path | None = None,
    ) -> None:
        self._scene = Scene([robots] if isinstance(robots, Robot) else robots)
        self._objects = Objects()
        self._turn = Turn(self._objects)
        self._name = name
        self._argv = argv
        self._realtime = realtime
        self._gui = gui
        self._seed = seed
        self._rviz = rviz
        self._curves = curves
        self._undo = contextlib.ExitStack()
        # Outlives the world: a process becomes a node only once.
        self._node = contextlib.ExitStack()
        self._started_simulator = False

    def start(self, say: Say) -> None:
        """Starts what is missing, and makes this the process's session.

        A simulator that was started here and dies before its robots are brought up is replaced once.

        Args:
            say: is told what is started.

        Raises:
            RobotEnvError: if something can't be started, or what runs doesn't fit; what was
                started before that is for `close()` to end.
        """
        try:
            self._begin(say)
        except RobotEnvError as error:
            if not self._started_simulator or simulator.answers():
                raise
            rospy.logwarn("%s; another simulator is started in its place", error)
            self._undo.close()
            self._begin(say)

    def _begin(self, say: Say) -> None:
        self._started_simulator = False
        if rospy.core.is_initialized() and rospy.is_shutdown():
            raise RobotEnvError(
                "this process's ROS node has ended, and a process becomes one only once; keep a "
                "session until the end, or begin another process"
            )
        if self._rviz:
            check_rviz(self._scene.robots[0])
        if not simulator.answers():
            say("starting the simulator")
            simulator.start(
                self._scene.robots[0].world,
                lockstep=not self._realtime,
                gui=self._gui,
                seed=self._seed,
                undo=self._undo,
            )
            self._started_simulator = True
        self._join()
        simulator.check_mode(self._realtime)
        world.check_world(self._scene.robots[0])
        if self._curves is not None:
            self._undo.callback(show_curves(self._curves))
        changes = bring_up(self._scene, say)
        if not self._started_simulator:  # otherwise it ends with all that is in it
            running = RunningSimulator()
            for undo in (*changes, lambda: self._objects(())):
                self._undo.callback(simulator.undo_there, running, undo)
        if self._gui and not self._started_simulator and is_open():
            tell_open(say)
        elif self._gui:
            if not self._started_simulator:
                self._undo.callback(open_window(say))
            tell_opening(say, begun=not self._started_simulator)
        if self._rviz:
            say("opening RViz")
            self._undo.callback(open_rviz(self._scene.robots[0]))
        _started().append(self)
        self._undo.callback(_started().remove, self)

    def serves(self, scene: Scene, realtime: bool) -> bool:
        """Whether it is these robots', and moves as asked."""
        return self.moves(scene.robots) and self._realtime == realtime

    def moves(self, robots: Sequence[Robot]) -> bool:
        """Whether it is these robots'."""
        return self._scene.robots == tuple(robots)

    def connect(
        self, scene: Scene, control_period: float, deadline: float | None = None
    ) -> RobotBackend:
        """A connection of its own to the robots; whoever asks for it closes it.

        Args:
            scene: the session's robots, and objects, which are in the world while it is this one's turn.
            control_period: simulated time [s] of one action; in real time 0 takes the newest
                joint state without waiting for another one.
            deadline: wall time [s] that an answer in lock-step may take, beside 10 ms for each tick.

        Raises:
            ValueError: if the period isn't a whole number of physics steps.
            RobotEnvError: if the simulator doesn't answer, or an object can't be spawned.
        """
        ticks = ticks_per_action(control_period, world.physics_step()) if control_period else 0
        if self._realtime:
            from robot_envs.backends.ros.realtime.world import RealtimeWorld

            return RealtimeWorld(scene, control_period, self._turn)
        from robot_envs.backends.ros.lockstep import LockstepWorld

        return LockstepWorld(scene, ticks, self._turn, deadline or TIMEOUT)

    def _join(self) -> None:
        """Becomes a node, unless the process is one; the training handles signals itself."""
        if rospy.core.is_initialized():
            return
        node.refuse_twin(self._name)
        rospy.init_node(os.path.basename(self._name), argv=["", *self._argv], disable_signals=True)
        self._node.callback(rospy.signal_shutdown, "training ended")

    def make_room(self) -> None:
        """Ends what `start()` started, all but the node: another world comes.

        Raises:
            RobotEnvError: if an environment still uses it.
        """
        if self._turn.is_used:
            raise RobotEnvError(
                "over ROS a process moves one world at a time, and an environment of "
                f"'{self._scene.robots[0].model}' is open; close() it first, or put several robots into "
                "one world: RobotEnv([first, second], task)"
            )
        self._undo.close()

    def close(self) -> None:
        """Ends what `start()` started; may be called twice."""
        try:
            self._undo.close()
        finally:
            self._node.close()


def running_session(scene: Scene, realtime: bool) -> RosSession:
    """The process's session, started if there is none; that one runs until the process ends.

    Where its simulator has died, another one is started. A session of other robots ends for it.

    Raises:
        RobotEnvError: if something can't be started, or what runs doesn't fit, or an environment of other
            robots is open.
    """
    for session in reversed(_started()[:]):
        lives = world.simulator_answers()
        if session.serves(scene, realtime):
            if lives:
                return session
            break
        if lives and not session.moves(scene.robots):
            session.make_room()
    name = f"/{_name(scene)}_env_{os.getpid()}"
    session = RosSession(scene.robots, name, [], realtime=realtime, gui=False, seed=0)
    try:
        session.start(rospy.loginfo)
    except BaseException:  # Ctrl-C, too: nothing that was started may stay behind
        session.close()
        raise
    atexit.register(session.close)
    return session


def _name(scene: Scene) -> str:
    """A robot's model, as far as a node may be called so."""
    return re.sub(r"\W", "_", scene.robots[0].model, flags=re.ASCII).strip("_") or "robot"


@lru_cache(maxsize=1)
def _started() -> list[RosSession]:
    """The process's sessions, oldest first: a process can become a ROS node only once."""
    return []
