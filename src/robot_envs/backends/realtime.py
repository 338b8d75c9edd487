"""A robot in a simulator over ROS whose time runs by itself: Gazebo's own services and topics alone."""

import threading
import time
from collections.abc import Mapping, Sequence
from typing import Any, Generic

import rospy
from gazebo_msgs.srv import SetModelConfiguration
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.base_pose import base_pose
from robot_envs.backends.bring_up import ready
from robot_envs.backends.messages import read_state
from robot_envs.backends.own_simulator import OwnSimulator
from robot_envs.backends.ros_variation import RosVariation
from robot_envs.backends.service import ServiceClient
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.robot import Robot, State
from robot_envs.task import Command
from robot_envs.variation import Variation
from robot_envs.world_state import Motion, StateQuery, WorldState

STATE_TIMEOUT = 5.0  # [s] of wall time without a joint state
RESET_WAIT = 0.5  # [s] of wall time for the joint state that a reset publishes
_SAME = 1e-6  # [m], [rad]
_EARLY = 1e-6  # [s]; of rounding
_ONLY_JOINTS = "a world in real time gives the joints alone (backend 'ros-realtime')"


class _Resetter:
    """Puts a robot's joints in place through Gazebo's own services."""

    def __init__(self, robot: Robot[State]) -> None:
        self._model, self._joints = robot.model, list(robot.joints)
        self._description = robot.over_ros.description
        self._reset_world = ServiceClient("/gazebo/reset_world", Empty)
        self._set_joints = ServiceClient("/gazebo/set_model_configuration", SetModelConfiguration)

    def __call__(self, positions: Sequence[float]) -> None:
        self._reset_world()
        answer = self._set_joints(self._model, self._description, self._joints, positions)
        if not answer.success:
            raise SimulatorError(f"the robot can't be reset: {answer.status_message}")


class _CommandTopic:
    """Where one controller listens for its commands.

    Args:
        robot: the robot.
        controller: its name.
    """

    def __init__(self, robot: Robot[Any], controller: str) -> None:
        self._robot = robot
        self._controller = controller
        self._publisher = self._offer()

    def _offer(self) -> rospy.Publisher:
        return rospy.Publisher(f"/{self._controller}/command", Float64, queue_size=1)

    def publish(self, value: float) -> None:
        """Commands the controller."""
        self._publisher.publish(value)

    def wait(self) -> None:
        """Waits until the controller listens; offers the topic anew halfway.

        A listener that asks for it between one environment's end and the next one's beginning, in the
        same process, is turned away, and rospy doesn't ask again.

        Raises:
            SimulatorError: if it doesn't in time.
        """
        if self._is_linked(STATE_TIMEOUT / 2):
            return
        self._publisher.unregister()
        self._publisher = self._offer()
        if not self._is_linked(STATE_TIMEOUT / 2):
            raise SimulatorError(
                f"nobody listens on {self._publisher.resolved_name}: {ready(self._robot).missing()}"
            )

    def _is_linked(self, bound: float) -> bool:
        """Whether somebody listens to the commands, at the latest after that time [s]."""
        deadline = time.monotonic() + bound
        while self._publisher.get_num_connections() == 0:
            if time.monotonic() > deadline:
                return False
            time.sleep(0.01)
        return True

    def close(self) -> None:
        """Leaves the topic."""
        self._publisher.unregister()


class RealtimeRobot(Generic[State]):
    """As the existing script does it, with nothing but Gazebo's services and topics.

    An action unpauses the world, publishes the commands, and takes the newest joint state; so
    how much simulated time it gets depends on the machine.

    Args:
        robot: the robot; it is there, and its controllers run.
        control_period: simulated time [s] from one joint state to the next one that is taken;
            None takes the newest one without waiting for another one.
    """

    deterministic, shared = False, True

    def __init__(self, robot: Robot[State], control_period: float | None = None) -> None:
        self.robot = robot
        self._period = control_period
        self._simulator = OwnSimulator()
        self._variation = RosVariation(robot)
        self._reset = _Resetter(robot)
        self._pause = ServiceClient("/gazebo/pause_physics", Empty)
        self._unpause = ServiceClient("/gazebo/unpause_physics", Empty)
        self._topics = [_CommandTopic(robot, name) for name in robot.commanded]
        self._newest: tuple[JointState, float] | None = None  # with its wall time [s]
        self._arrived = threading.Condition()
        self._subscriber = rospy.Subscriber(
            "/joint_states", JointState, self._receive, queue_size=1, tcp_nodelay=True
        )

    def _receive(self, message: JointState) -> None:
        # joint_state_publisher's messages are all zero and carry no velocities.
        if message.velocity:
            with self._arrived:
                self._newest = (message, time.monotonic())
                self._arrived.notify_all()

    def reset(self, state: State, placed: Mapping[str, Motion] | None = None) -> State:
        """See `RobotBackend.reset`; leaves the world paused.

        Waits for the joint state that the reset publishes. A simulator that is silent while
        paused is believed to have done what it said.

        Raises:
            RobotEnvError: for models to place.
        """
        if placed:
            raise RobotEnvError(f"{_ONLY_JOINTS}: models can't be placed in it")
        positions = state[::2]
        with self._simulator:
            for topic in self._topics:
                topic.wait()
            self._pause()
            self._reset(positions)
        self._wait_for(positions)
        return self.robot.state_of(number for place in positions for number in (place, 0.0))

    def _wait_for(self, positions: Sequence[float]) -> None:
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._is_at(positions), RESET_WAIT):
                self._newest = None

    def _is_at(self, positions: Sequence[float]) -> bool:
        if self._newest is None:
            return False
        found = read_state(self.robot, self._newest[0])[::2]
        return all(abs(a - b) < _SAME for a, b in zip(found, positions, strict=True))

    def act(self, command: Command) -> State:
        """See `RobotBackend.act`.

        Raises:
            SimulatorError: if joint states stop coming or the simulator doesn't answer.
        """
        with self._simulator:
            self._unpause()
            with self._arrived:
                due = self._due()
            for topic, value in zip(self._topics, command, strict=True):
                topic.publish(value)
            with self._arrived:
                return read_state(self.robot, self._wait_until(due))

    def _wait_until(self, due: float | None) -> JointState:
        """A long control period takes its time, as long as joint states come."""
        while True:
            there = self._arrived.wait_for(lambda: self._is_there(due), STATE_TIMEOUT)
            newest = self._newest
            if newest is None or time.monotonic() - newest[1] > STATE_TIMEOUT:
                raise SimulatorError(
                    f"no joint state on /joint_states for {STATE_TIMEOUT:g} s: "
                    f"{ready(self.robot).missing() or 'is the world running?'}"
                )
            if there:
                return newest[0]

    def _due(self) -> float | None:
        """Simulated time [s] of the joint state to wait for; None: any will do."""
        if self._period is None or self._newest is None:
            return None
        return self._newest[0].header.stamp.to_sec() + self._period

    def _is_there(self, due: float | None) -> bool:
        if self._newest is None:
            return False
        return due is None or self._newest[0].header.stamp.to_sec() > due - _EARLY

    def look(self, query: StateQuery) -> None:
        """See `RobotBackend.look`.

        Raises:
            RobotEnvError: in any case but for a query of nothing.
        """
        if query != StateQuery():
            raise RobotEnvError(f"{_ONLY_JOINTS}: links, models and contacts aren't told")

    def world(self) -> WorldState:
        """See `RobotBackend.world`.

        Raises:
            RobotEnvError: in any case.
        """
        raise RobotEnvError(f"{_ONLY_JOINTS}, as its state")

    def vary(self, variation: Variation) -> None:
        """See `RobotBackend.vary`."""
        self._variation(variation)

    def base(self) -> Pose:
        """See `RobotBackend.base`.

        Raises:
            SimulatorError: if the simulator doesn't answer.
        """
        with self._simulator:
            return base_pose(self.robot)

    def close(self) -> None:
        """Leaves the topics; the world stays as it is, the robot as it was found."""
        self._subscriber.unregister()
        for topic in self._topics:
            topic.close()
        self._variation.undo()
