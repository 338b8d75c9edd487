"""A robot in a simulator over ROS whose time runs by itself: Gazebo's own services and topics alone."""

import contextlib
import threading
import time
from collections.abc import Mapping, Sequence
from typing import Any

import rospy
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import GetLinkState, SetModelConfiguration, SetModelState
from geometry_msgs.msg import Point, Quaternion, Twist, Vector3
from geometry_msgs.msg import Pose as PoseMsg
from sensor_msgs.msg import JointState as JointStateMsg
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Empty

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.ros.bring_up import full_name, ready
from robot_envs.backends.ros.own_simulator import OwnSimulator
from robot_envs.backends.ros.service import ServiceClient
from robot_envs.backends.ros.turn import Turn
from robot_envs.backends.ros.variation import RosVariation
from robot_envs.backends.ros.wire.messages import JointReader, pose_of
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.world_state import (
    Commands,
    InitialState,
    JointState,
    Motion,
    StateQuery,
    WorldState,
)

STATE_TIMEOUT = 5.0  # [s] of wall time without a joint state
RESET_WAIT = 0.5  # [s] of wall time for the joint state that a reset publishes
_SAME = 1e-6  # [m], [rad]
_EARLY = 1e-6  # [s]; of rounding
_ONLY_JOINTS = "a world in real time gives the joints alone (backend 'ros-realtime')"


class _Resetter:
    """Puts robots and models in place through Gazebo's own services."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._reset_world = ServiceClient("/gazebo/reset_world", Empty)
        self._set_joints = ServiceClient("/gazebo/set_model_configuration", SetModelConfiguration)
        self._set_model = ServiceClient("/gazebo/set_model_state", SetModelState)

    def __call__(self, positions: Mapping[str, float], models: Mapping[str, Motion]) -> None:
        self._reset_world()
        for name, (pose, (line, turn)) in models.items():
            at = PoseMsg(Point(*pose.position), Quaternion(*pose.orientation))
            wanted = ModelState(name, at, Twist(Vector3(*line), Vector3(*turn)), "world")
            _check(self._set_model(wanted), f"model '{name}' can't be placed")
        for robot in self._scene.robots:
            own = {
                name: positions[key] for key, (of, name) in self._scene.moved.items() if of is robot
            }
            answer = self._set_joints(
                robot.model, full_name(robot, robot.description), list(own), list(own.values())
            )
            _check(answer, f"the robot '{robot.model}' can't be reset")


def _check(answer: Any, what: str) -> None:
    if not answer.success:
        raise SimulatorError(f"{what}: {answer.status_message}")


class _CommandTopic:
    """Where one controller listens for its commands.

    Args:
        scene: the robots.
        controller: its full name.
        single: whether it takes one number, and no list.
    """

    def __init__(self, scene: Scene, controller: str, single: bool) -> None:
        self._scene = scene
        self._controller = controller
        self._single = single
        self._publisher = self._offer()

    def _offer(self) -> rospy.Publisher:
        kind = Float64 if self._single else Float64MultiArray
        return rospy.Publisher(f"{self._controller}/command", kind, queue_size=1)

    def publish(self, value: Any) -> None:
        """Commands the controller."""
        message = Float64(value) if self._single else Float64MultiArray(data=value)
        self._publisher.publish(message)

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
                f"nobody listens on {self._publisher.resolved_name}: {ready(self._scene).missing()}"
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


class RealtimeWorld:
    """As the existing script does it, with nothing but Gazebo's services and topics.

    An action unpauses the world, publishes the commands, and takes the newest joint state; so
    how much simulated time it gets depends on the machine.

    Args:
        scene: the robot; it is there, and its controllers run.
        control_period: simulated time [s] from one joint state to the next one that is taken;
            0 takes the newest one without waiting for another one.
        turn: whose episode is under way, among those that move this robot.

    Raises:
        RobotEnvError: for several robots.
    """

    deterministic, shared = False, True

    def __init__(self, scene: Scene, control_period: float, turn: Turn) -> None:
        if scene.several:
            raise RobotEnvError(f"{_ONLY_JOINTS}, and those of one robot")
        self.scene, self._turn = scene, turn
        self._robot = robot = scene.robots[0]
        self._period = control_period or None
        self._simulator = OwnSimulator()
        self._variation = RosVariation(scene)
        self._reset = _Resetter(scene)
        self._read = JointReader(scene)
        self._held: dict[str, Any] = {}
        self._begin = 0.0  # [s] of the episode
        self._get_link = ServiceClient("/gazebo/get_link_state", GetLinkState)
        self._pause = ServiceClient("/gazebo/pause_physics", Empty)
        self._unpause = ServiceClient("/gazebo/unpause_physics", Empty)
        self._topics = {
            name: _CommandTopic(scene, full_name(robot, port.name), port.single)
            for name, (_, port) in scene.ports.items()
        }
        self._newest: tuple[JointStateMsg, float] | None = None  # with its wall time [s]
        self._arrived = threading.Condition()
        turn.join(self)
        self._subscriber = rospy.Subscriber(
            full_name(robot, "joint_states"),
            JointStateMsg,
            self._receive,
            queue_size=1,
            tcp_nodelay=True,
        )

    def _receive(self, message: JointStateMsg) -> None:
        # joint_state_publisher's messages are all zero and carry no velocities.
        if message.velocity:
            with self._arrived:
                self._newest = (message, time.monotonic())
                self._arrived.notify_all()

    def reset(self, initial: InitialState) -> WorldState:
        """See `RobotBackend.reset`; leaves the world paused, and joints at rest.

        Waits for the joint state that the reset publishes. A simulator that is silent while
        paused is believed to have done what it said.

        Raises:
            ValueError: for a joint to place that isn't there.
            SimulatorError: if the simulator refuses, or doesn't answer.
        """
        positions = {name: at for name, (at, _) in self.scene.placed_joints(initial).items()}
        with self._simulator:
            self._turn.take(self)
            for topic in self._topics.values():
                topic.wait()
            self._pause()
            self._reset(positions, self.scene.placed_models(initial))
        self._wait_for(positions)
        joints = {name: JointState(positions[name], 0.0, 0.0) for name in self.scene.joints}
        self._held = self.scene.starting_commands(joints)
        self._begin = 0.0 if self._newest is None else self._newest[0].header.stamp.to_sec()
        return WorldState(0.0, joints, self._held)

    def _wait_for(self, positions: Mapping[str, float]) -> None:
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._is_at(positions), RESET_WAIT):
                self._newest = None

    def _is_at(self, positions: Mapping[str, float]) -> bool:
        if self._newest is None:
            return False
        found = self._read(self._newest[0])
        return all(abs(joint.position - positions[name]) < _SAME for name, joint in found.items())

    def begin(self, commands: Commands) -> None:
        """See `RobotBackend.begin`; there is nothing to begin."""

    def act(self, commands: Commands) -> WorldState:
        """See `RobotBackend.act`.

        Raises:
            SimulatorError: if joint states stop coming or the simulator doesn't answer, or another
                environment has moved the robot since the reset.
        """
        self._turn.check(self)
        with self._simulator:
            self._unpause()
            with self._arrived:
                due = self._due()
            for name, command in commands.items():
                self._topics[name].publish(command)
            self._held = {**self._held, **commands}
            with self._arrived:
                message = self._wait_until(due)
        passed = message.header.stamp.to_sec() - self._begin
        return WorldState(max(0.0, passed), self._read(message), self._held)

    def _wait_until(self, due: float | None) -> JointStateMsg:
        """A long control period takes its time, as long as joint states come."""
        while True:
            there = self._arrived.wait_for(lambda: self._is_there(due), STATE_TIMEOUT)
            newest = self._newest
            if newest is None or time.monotonic() - newest[1] > STATE_TIMEOUT:
                raise SimulatorError(
                    f"no joint state on /joint_states for {STATE_TIMEOUT:g} s: "
                    f"{ready(self.scene).missing() or 'is the world running?'}"
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

    def vary(self, variation: Variation) -> None:
        """See `RobotBackend.vary`."""
        with self._simulator:
            self._turn.take(self)  # what others have varied isn't this one's to start from
        self._variation(variation)

    def give_back(self) -> None:
        """See `Player.give_back`."""
        self._variation.undo()

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """See `RobotBackend.poses`; a call for each.

        Raises:
            SimulatorError: if the simulator doesn't answer, or has no such link.
        """
        with self._simulator:
            answers = [self._get_link(link, "world") for link in links]
        for link, answer in zip(links, answers, strict=True):
            _check(answer, f"where '{link}' is isn't told")
        return [pose_of(answer.link_state.pose) for answer in answers]

    def close(self) -> None:
        """Leaves the topics; the world stays as it is, robot and objects as they were found."""
        self._subscriber.unregister()
        for topic in self._topics.values():
            topic.close()
        self._variation.undo()
        with contextlib.suppress(SimulatorError):  # one that is gone has no objects any more
            self._turn.release(self)
