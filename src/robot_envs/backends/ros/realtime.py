"""Backend for a simulator in real time, by Gazebo's own services and topics alone."""

import contextlib
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import rospy
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import GetLinkState, SetModelConfiguration, SetModelState
from geometry_msgs.msg import Point, Quaternion, Twist, Vector3
from geometry_msgs.msg import Pose as PoseMsg
from sensor_msgs.msg import JointState as JointStateMsg
from std_srvs.srv import Empty

from robot_envs.backends.backend import RobotBackend
from robot_envs.backends.ros.bringup import command_publisher, full_name, ready
from robot_envs.backends.ros.properties import RosVariation
from robot_envs.backends.ros.running import (
    JointStateReader,
    RunningSimulator,
    SharedWorld,
    SimulatorService,
    check_success,
)
from robot_envs.backends.ros.sensor_listener import SensorListener
from robot_envs.controllers import CommandPort
from robot_envs.errors import RestoreRefused, RobotEnvError, SimulatorError
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.snapshot import WorldSnapshot
from robot_envs.variation import Variation
from robot_envs.world_state import (
    ONLY_REWARDED,
    Commands,
    InitialState,
    JointState,
    Motion,
    StateQuery,
    WorldState,
)
from robot_sim.constants import NANOSECONDS
from robot_sim.physics.pose import Pose
from ros_calls.waiting import wait_until

STATE_TIMEOUT = 5.0  # [s] of wall time without a joint state
RESET_WAIT = 0.5  # [s] of wall time for the joint state that a reset publishes
_SAME = 1e-6  # [m], [rad]
_EARLY = 1e-6  # [s] of rounding error
_ONLY_JOINTS = "a world in real time gives joints and sensors alone (backend 'ros-realtime')"


class JointStates:
    """Subscribes to the joint states of a scene's one robot, and keeps the newest."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._read = JointStateReader(scene)
        self._newest: tuple[JointStateMsg, float] | None = None  # with its wall time [s]
        self._arrived = threading.Condition()
        self._subscriber = rospy.Subscriber(
            full_name(scene.robots[0], "joint_states"),
            JointStateMsg,
            self._receive,
            queue_size=1,
            tcp_nodelay=True,
        )

    def _receive(self, message: JointStateMsg) -> None:
        # Messages of joint_state_publisher are all zero, and carry no velocities.
        if message.velocity:
            with self._arrived:
                self._newest = (message, time.monotonic())
                self._arrived.notify_all()

    @property
    def time(self) -> float | None:
        """Simulated time of the newest [s]; None if there is none."""
        with self._arrived:
            return None if self._newest is None else self._newest[0].header.stamp.to_sec()

    def forget_unless_at(self, positions: Mapping[str, float]) -> None:
        """Waits a moment for a joint state with these positions; if none comes, forgets the newest."""
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._is_at(positions), RESET_WAIT):
                self._newest = None

    def _is_at(self, positions: Mapping[str, float]) -> bool:
        if self._newest is None:
            return False
        joints = self._read(self._newest[0])
        return all(abs(joint.position - positions[name]) < _SAME for name, joint in joints.items())

    def wait_until(self, due: float | None) -> tuple[float, dict[str, JointState]]:
        """Waits for the joint state of a time, or any for None; returns its time [s], and the joints.

        There is no bound on a long control period; raises SimulatorError if joint states stop coming.
        """
        with self._arrived:
            while True:
                there = self._arrived.wait_for(lambda: self._is_there(due), STATE_TIMEOUT)
                newest = self._newest
                if newest is None or time.monotonic() - newest[1] > STATE_TIMEOUT:
                    raise SimulatorError(
                        f"no joint state on /joint_states for {STATE_TIMEOUT:g} s: "
                        f"{ready(self._scene).missing() or 'is the world running?'}"
                    )
                if there:
                    break
        return newest[0].header.stamp.to_sec(), self._read(newest[0])

    def _is_there(self, due: float | None) -> bool:
        if self._newest is None:
            return False
        return due is None or self._newest[0].header.stamp.to_sec() > due - _EARLY

    def close(self) -> None:
        """Unsubscribes."""
        self._subscriber.unregister()


class CommandTopic:
    """The topic on which a robot's controller listens for commands."""

    def __init__(self, scene: Scene, robot: Robot, port: CommandPort) -> None:
        self._scene, self._robot, self._port = scene, robot, port
        self._publisher = command_publisher(robot, port)

    def publish(self, value: Any) -> None:
        """Commands the controller."""
        self._publisher.publish(self._port.kind.write(value))

    def wait(self) -> None:
        """Waits until the controller listens; advertises the topic again halfway.

        rospy turns a subscriber away that connects between one environment's end and the next one's beginning
        in the same process, and doesn't try again. Raises SimulatorError after STATE_TIMEOUT.
        """
        topic = self._publisher.resolved_name
        if wait_until(self._publisher.get_num_connections, STATE_TIMEOUT / 2, topic):
            return
        self._publisher.unregister()
        self._publisher = command_publisher(self._robot, self._port)
        if not wait_until(self._publisher.get_num_connections, STATE_TIMEOUT / 2, topic):
            raise SimulatorError(f"no node listens on {topic}: {ready(self._scene).missing()}")

    def close(self) -> None:
        """Leaves the topic."""
        self._publisher.unregister()


class RealtimeWorld(RobotBackend):
    """Moves one robot as the existing script does, with nothing but Gazebo's services and topics.

    An action unpauses the world, publishes the commands, and takes the joint state one control period [s]
    later, or the newest for 0. How much simulated time passes depends on the machine.
    """

    deterministic, complete, shared = False, False, True

    def __init__(self, scene: Scene, control_period: float, world: SharedWorld) -> None:
        if scene.several:
            raise RobotEnvError(f"{_ONLY_JOINTS}, and those of one robot")
        self.scene, self._world = scene, world
        self._period = control_period or None
        self._simulator = RunningSimulator()
        self._variation = RosVariation(scene)
        self._pause = SimulatorService("/gazebo/pause_physics", Empty)
        self._unpause = SimulatorService("/gazebo/unpause_physics", Empty)
        self._reset_world = SimulatorService("/gazebo/reset_world", Empty)
        self._set_joints = SimulatorService("/gazebo/set_model_configuration", SetModelConfiguration)
        self._set_model = SimulatorService("/gazebo/set_model_state", SetModelState)
        self._get_link = SimulatorService("/gazebo/get_link_state", GetLinkState)
        self._held: dict[str, Any] = {}
        self._is_paused = False
        self._begin = 0.0  # [s] of the episode
        self._topics = {name: CommandTopic(scene, robot, port) for name, (robot, port) in scene.ports.items()}
        world.join(self)
        self._states = JointStates(scene)
        self._sensors = SensorListener(scene.robots[0], (), time.monotonic)

    def reset(self, initial: InitialState, seed: int = 0) -> WorldState:
        """See `RobotBackend.reset`; leaves the world paused, and joints at rest.

        A simulator that publishes no joint state while paused is taken to have the joints where they were
        put.
        """
        positions = {name: at for name, (at, _) in self.scene.placed_joints(initial).items()}
        with self._simulator:
            self._world.claim(self)
            for topic in self._topics.values():
                topic.wait()
            self._pause()
            self._is_paused = True
            self._reset_world()
            for name, motion in self.scene.placed_models(initial).items():
                self._place_model(name, motion)
            self._sensors.forget()
            self._place_joints(positions)
            self._await_sensors()
        self._states.forget_unless_at(positions)
        joints = {name: JointState(positions[name], 0.0, 0.0) for name in self.scene.joints}
        self._held = self.scene.starting_commands(joints)
        self._begin = self._states.time or 0.0
        self._variation.push(initial.pushes, round(self._begin * NANOSECONDS))
        return WorldState(0.0, joints, self._held, sensors=self._sensors.read(self._begin))

    def _await_sensors(self) -> None:
        """Waits for measurements of the placed robot; if none come while time stands still, lets it run."""
        if self._sensors.wait(RESET_WAIT):
            return
        self._unpause()
        came = self._sensors.wait(STATE_TIMEOUT)
        self._pause()
        if not came:
            missing = ", ".join(self._sensors.missing())
            raise SimulatorError(
                self._sensors.fault() or f"no message on {missing} for {STATE_TIMEOUT:g} s since the reset"
            )

    def _place_model(self, name: str, motion: Motion) -> None:
        pose, (linear, angular) = motion
        at = PoseMsg(Point(*pose.position), Quaternion(*pose.orientation))
        wanted = ModelState(name, at, Twist(Vector3(*linear), Vector3(*angular)), "world")
        check_success(self._set_model(wanted), f"model '{name}' can't be placed")

    def _place_joints(self, positions: Mapping[str, float]) -> None:
        """Puts all joints at their positions [rad, m], by name in the scene, at rest."""
        robot = self.scene.robots[0]
        own = {name: positions[key] for key, (_, name) in self.scene.moved.items()}
        answer = self._set_joints(
            robot.model, full_name(robot, robot.description), list(own), list(own.values())
        )
        check_success(answer, f"the robot '{robot.model}' can't be reset")

    def begin(self, commands: Commands) -> None:
        """See `RobotBackend.begin`; does nothing."""

    def act(self, commands: Commands) -> WorldState:
        self._world.check_holder(self)
        with self._simulator:
            self._unpause()
            if self._is_paused:
                self._sensors.resume()
                self._is_paused = False
            last = self._states.time
            due = None if self._period is None or last is None else last + self._period
            for name, command in commands.items():
                self._topics[name].publish(command)
            self._held = {**self._held, **commands}
            now, joints = self._states.wait_until(due)
        if trouble := self._sensors.trouble(STATE_TIMEOUT):
            raise SimulatorError(trouble)
        passed = max(0.0, now - self._begin)
        return WorldState(passed, joints, self._held, sensors=self._sensors.read(self._begin))

    def look(self, query: StateQuery) -> None:
        if replace(query, sensors=()) != StateQuery():
            raise RobotEnvError(f"{_ONLY_JOINTS}: it has no links, models and contacts{ONLY_REWARDED}")
        self._sensors.close()
        self._sensors = SensorListener(self.scene.robots[0], query.sensors, time.monotonic)

    def vary(self, variation: Variation) -> None:
        with self._simulator:
            self._world.claim(self)  # undoes what others have varied
        self._variation(variation)

    def save_state(self) -> WorldSnapshot:
        raise SimulatorError("a world in real time can't be saved; in lock-step it can")

    def restore_state(self, state: WorldSnapshot) -> str:
        raise RestoreRefused("a world in real time can't be restored; in lock-step it can")

    def begin_at(self, state: WorldSnapshot, seed: int = 0) -> WorldState:
        raise SimulatorError("a world in real time can't begin at a snapshot; in lock-step it can")

    def restore(self) -> None:
        """See `SharedBackend.restore`."""
        self._variation.undo()

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """See `RobotBackend.poses`; makes a call for each."""
        poses = []
        with self._simulator:
            for link in links:
                answer = self._get_link(link, "world")
                check_success(answer, f"the pose of '{link}' isn't known")
                at = answer.link_state.pose
                place, turn = at.position, at.orientation
                poses.append(Pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w)))
        return poses

    def close(self) -> None:
        """Leaves the topics, and restores robot and objects; the world stays paused or running."""
        self._states.close()
        self._sensors.close()
        for topic in self._topics.values():
            topic.close()
        self._variation.undo()
        with contextlib.suppress(SimulatorError):  # a simulator that is gone has no objects either
            self._world.leave(self)
