"""Everything a training over ROS needs to be running: used where it runs, started where not."""

import contextlib
import os

import rospy

from cartpole.envs import ros_node, ros_robot
from cartpole.envs.plant import Plant
from cartpole.envs.ros_plants import STEP_SERVICE, LockstepPlant, RealtimePlant
from cartpole.envs.ros_robot import Say, Undo
from cartpole.errors import CartpoleError
from ros_utils import ros_gazebo

START_TIMEOUT = 60.0  # [s] for the simulator to come up


class RosSession:
    """Brings up master, simulator, robot and controllers; `close()` ends just what it started.

    Args:
        name: this process's node name, with namespace.
        argv: the process's arguments, with roslaunch's remappings.
        realtime: let the world run by itself, instead of in lock-step.
        gui: ask a simulator that is started here for its window.
        seed: for a simulator that is started here.
        height: above the ground, where a robot that is spawned here stands [m].
    """

    def __init__(
        self,
        name: str,
        argv: list[str],
        realtime: bool,
        gui: bool,
        seed: int,
        height: float = 0.0,
    ) -> None:
        self._name = name
        self._argv = argv
        self._realtime = realtime
        self._gui = gui
        self._seed = seed
        self._height = height
        self._undo = contextlib.ExitStack()

    def start(self, say: Say) -> Plant:
        """Starts what is missing and returns the robot, ready for its first reset.

        Raises:
            CartpoleError: if something can't be started, or what runs doesn't fit; what was
                started before that is for `close()` to end.
        """
        own_simulator = not (ros_node.master_is_up() and ros_robot.simulator_answers())
        if own_simulator:
            say("starting the simulator")
            self._start_simulator()
        self._join()
        self._check_mode()
        changes = ros_robot.bring_up(say, self._height)
        if not own_simulator:  # one of ours ends with all that is in it
            for undo in changes:
                self._undo.callback(_at_living_simulator, undo)
        plant: Plant = RealtimePlant() if self._realtime else LockstepPlant()
        self._undo.callback(plant.close)
        return plant

    def _start_simulator(self) -> None:
        started = ros_gazebo.launch_Gazebo(
            paused=True,
            gui=self._gui,
            output="log",
            launch_new_term=False,
            lockstep=not self._realtime,
            seed=self._seed,
            timeout=START_TIMEOUT,
        )
        if not started:
            raise CartpoleError("the simulator didn't start; see the messages above")
        self._undo.callback(ros_gazebo.close_Gazebo)

    def _join(self) -> None:
        """Becomes a node, unless the process is one; the training handles signals itself."""
        if rospy.core.is_initialized():
            return
        ros_node.refuse_twin(self._name)
        rospy.init_node(os.path.basename(self._name), argv=["", *self._argv], disable_signals=True)
        self._undo.callback(rospy.signal_shutdown, "training ended")

    def _check_mode(self) -> None:
        lockstep = ros_node.service_is_registered(STEP_SERVICE)
        if self._realtime and lockstep:
            raise CartpoleError(
                f"the running simulator moves in lock-step (it has {STEP_SERVICE}): its time would stand "
                "still; train without --realtime, or start it with lockstep:=false"
            )
        if not self._realtime and not lockstep:
            raise CartpoleError(
                f"the running simulator has no {STEP_SERVICE}: start it with lockstep:=true "
                "(roslaunch cartpole simulation.launch does), or train with --realtime"
            )

    def close(self) -> None:
        """Ends what `start()` started, newest first; may be called twice."""
        self._undo.close()


def _at_living_simulator(undo: Undo) -> None:
    """Cleans up at a simulator that may have died meanwhile."""
    with contextlib.suppress(CartpoleError, rospy.ServiceException, rospy.ROSException, OSError):
        if ros_robot.simulator_answers():
            undo()
