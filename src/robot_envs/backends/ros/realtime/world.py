"""A robot in a simulator over ROS whose time runs by itself: Gazebo's own services and topics alone."""

import contextlib
from collections.abc import Sequence
from typing import Any

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.ros.bringup.robots import full_name
from robot_envs.backends.ros.realtime.command_topic import CommandTopic
from robot_envs.backends.ros.realtime.joint_states import JointStates
from robot_envs.backends.ros.realtime.services import GazeboServices
from robot_envs.backends.ros.running_simulator import RunningSimulator
from robot_envs.backends.ros.turn import Turn
from robot_envs.backends.ros.variation import RosVariation
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.world_state import Commands, InitialState, JointState, StateQuery, WorldState

_ONLY_JOINTS = "a world in real time gives the joints alone (backend 'ros-realtime')"


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
        self._period = control_period or None
        self._simulator = RunningSimulator()
        self._variation = RosVariation(scene)
        self._services = GazeboServices(scene)
        self._held: dict[str, Any] = {}
        self._begin = 0.0  # [s] of the episode
        self._topics = {
            name: CommandTopic(scene, full_name(robot, port.name), port.single)
            for name, (robot, port) in scene.ports.items()
        }
        turn.join(self)
        self._states = JointStates(scene)

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
            self._services.pause()
            self._services.reset(positions, self.scene.placed_models(initial))
        self._states.forget_unless_at(positions)
        joints = {name: JointState(positions[name], 0.0, 0.0) for name in self.scene.joints}
        self._held = self.scene.starting_commands(joints)
        self._begin = self._states.time or 0.0
        return WorldState(0.0, joints, self._held)

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
            self._services.unpause()
            due = self._due()
            for name, command in commands.items():
                self._topics[name].publish(command)
            self._held = {**self._held, **commands}
            now, joints = self._states.wait_until(due)
        return WorldState(max(0.0, now - self._begin), joints, self._held)

    def _due(self) -> float | None:
        """Simulated time [s] of the joint state to wait for; None: any will do."""
        last = self._states.time
        return None if self._period is None or last is None else last + self._period

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
            return self._services.poses(links)

    def close(self) -> None:
        """Leaves the topics; the world stays as it is, robot and objects as they were found."""
        self._states.close()
        for topic in self._topics.values():
            topic.close()
        self._variation.undo()
        with contextlib.suppress(SimulatorError):  # one that is gone has no objects any more
            self._turn.release(self)
