"""The ROS node of a policy: joint states and sensors in, commands out."""

import math
import os
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Float64MultiArray

from robot_envs.backends.ros import node
from robot_envs.backends.ros.bringup import command_publisher, full_name
from robot_envs.backends.ros.running import lockstep_hint
from robot_envs.backends.ros.sensor_listener import SensorListener
from robot_envs.controllers import TWIST
from robot_envs.deployment.pilot import Pilot
from robot_envs.deployment.reports import OFF, ControllerWatch, JointListener
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.task import GoalTask, Task
from robot_envs.world_state import ODOMETRY, Command, JointState

LATE_PERIODS, LATE_AT_LEAST = 5, 0.1  # control periods, and [s]
LATE_AT_MOST = 0.3  # [s] of a vehicle, which drives on meanwhile
STANDING = (0.0, 0.0, 0.0)  # [m/s, rad/s]
COMMANDED = 0.5  # [s] that a walker follows a velocity, as cmd_vel_timeout of diff_drive_controller
POLL = 0.05  # [s] of wall time between two looks at what else might end a wait
MISSING_PATIENCE = 2.0  # [s] of wall time, until what is missing is logged
REPORTING = 1.0  # [s] of wall time between two lines about why the robot stands still
SENDING = 1.0  # [s] of wall time, for each of the last commands to be sent


class PolicyNode:
    """Runs a policy on a robot, as soon as its joint states come and its controllers listen.

    Each control period of ROS time it passes the newest joint states and readings of sensors to task and
    policy, and publishes their commands. While one of them is late, or the task's episode would have ended,
    it commands a stop instead (see `CommandLimits.stop`). At the end it stops the robot, also after `rosnode
    kill`, or an error of policy or task. The topic `~goal` (std_msgs/Float64MultiArray) changes the goal of a
    task with goals, `cmd_vel` (geometry_msgs/Twist) that of one that walks at a velocity: 0 at first, and
    when it has been silent for half a second.

    `late` is how long the robot may be without a joint state before it is stopped [s], or without a reading,
    but at least three of its sensor's periods; None: 5 control periods, but at least 0.1 s, and at most 0.3 s
    for a vehicle. The other arguments, and what is raised, are `Pilot`'s.
    """

    def __init__(
        self, robot: Robot, task: Task, act: Callable[[Any], Any], period: float,
        late: float | None = None, seed: int = 0, goal: Any = None, way: float = 1.0,
    ) -> None:  # fmt: skip
        self._period = period
        self._late = _late(robot, period) if late is None else late
        try:
            self._pilot = Pilot(robot, task, act, period, seed, goal, way, rospy.logwarn)
        except ValueError as error:
            raise RobotEnvError(str(error)) from error
        self._wanted: Any = None  # a goal that has come
        self._commanded: float | None = None  # when a velocity came [s]; None: it stands again
        self._logged: Any = None  # the goal that was logged last
        self._reason = self._reported = ""  # why the robot stands still, now and in the last line
        self._unreported = 0  # changes since that line
        self._next_report = 0.0  # [s of wall time] of the next one
        self._last: Mapping[str, JointState] | None = None  # joints; None: nothing was commanded
        self._should_end: Callable[[], bool] = rospy.is_shutdown
        self._is_killed, self._ended = threading.Event(), threading.Event()
        self._joints = JointListener(
            full_name(robot, "joint_states"), robot.model, robot.joints, robot.limits, self._late
        )
        odometry = (ODOMETRY,) if task.query.models else ()
        self._sensors = SensorListener(
            robot, (*task.query.sensors, *odometry), rospy.get_time, max(self._late, OFF)
        )
        self._controllers = ControllerWatch(robot, self._ended)
        self._ports = {port.name: port for port in robot.ports}
        self._topics = {port.name: command_publisher(robot, port) for port in robot.ports}
        self._pushing = {port.name for port in robot.ports if port.quantity != "position"}
        if isinstance(task, GoalTask) or type(task).aim is not Task.aim:
            rospy.Subscriber("~goal", Float64MultiArray, self._take_goal, queue_size=1)
        if task.aims_at_velocity:
            if goal is None:
                self._wanted = STANDING
            rospy.Subscriber(full_name(robot, "cmd_vel"), Twist, self._take_velocity, queue_size=1)

    def _take_goal(self, message: Float64MultiArray) -> None:
        self._wanted = message.data

    def _take_velocity(self, message: Twist) -> None:
        self._wanted = message.linear.x, message.linear.y, message.angular.z
        self._commanded = rospy.get_time()

    def run(self, should_end: Callable[[], bool]) -> None:
        """Runs until `should_end`, which is polled, or the node is shut down.

        A signal handler can't end the run itself: it may have interrupted a command that is being published.
        Raises RobotEnvError if policy or task return something impossible; the robot is stopped then.
        """
        self._should_end = should_end
        rospy.on_shutdown(self._end_in_time)
        try:
            self._follow()
        except ValueError as error:
            raise RobotEnvError(f"the robot is stopped: {error}") from error
        finally:
            self._end()
            self._ended.set()

    def _end_in_time(self) -> None:
        """Holds up `rosnode kill` until the robot is stopped: later messages wouldn't be sent."""
        self._is_killed.set()
        self._ended.wait(3.0 * SENDING)

    def _is_over(self) -> bool:
        return self._should_end() or self._is_killed.is_set() or rospy.is_shutdown()

    def _follow(self) -> None:
        began = before = self._begin()
        while not self._is_over():
            now = rospy.get_time()
            if now < before:  # a simulation was reset
                self._let_go()
                self._joints.forget()
                self._sensors.forget()
                began = before = self._begin()
                continue
            self._step(now, now - began)
            before = now
            periods = math.floor((now - began) / self._period + 1e-6)
            self._sleep_until(began + self._period * (periods + 1), now)

    def _begin(self) -> float:
        """Waits until all joints are known and all controllers listen; returns the time [s]."""
        beginning = time.monotonic()
        while (missing := self._missing()) and not self._is_over():
            if time.monotonic() - beginning > MISSING_PATIENCE:
                self._report(f"waiting for {missing}", lockstep_hint)
            self._let_go()
            rospy.rostime.wallsleep(POLL)
        if not missing:
            self._report("")
            self._last = self._joints.look()[0]
            self._pilot.begin(self._last, self._sensors.read(rospy.get_time()))
            rospy.loginfo("the policy moves the robot")
        return rospy.get_time()

    def _missing(self) -> str:
        joints = self._joints.missing()
        if joints and (fault := self._joints.fault()):
            return f"a possible state: {fault}"
        silent = self._sensors.missing()
        if silent and (fault := self._sensors.fault()):
            return f"a message that can be read: {fault}"
        missing = [f"the state of {', '.join(joints)} on {self._joints.topic}"] if joints else []
        missing += [f"a message on {topic}" for topic in silent]
        missing += [f"a subscriber of {topic}" for topic in self._unheard()]
        return ", and ".join(missing)

    def _unheard(self) -> list[str]:
        topics = self._topics.values()
        return [each.resolved_name for each in topics if each.get_num_connections() == 0]

    def _let_go(self) -> None:
        """Commands no velocity and no effort, if something was commanded; a commanded position stands."""
        if self._last is not None:
            commands = self._pilot.stop(self._last)
            self._publish({name: commands[name] for name in self._pushing})

    def _sleep_until(self, due: float, seen: float) -> None:
        """Sleeps until a ROS time [s], or until time has gone back behind `seen`, or the run should end."""
        clock, since = rospy.rostime.get_rostime_cond(), time.monotonic()
        while seen <= (now := rospy.get_time()) < due and not self._is_over():
            if rospy.rostime.is_wallclock():
                rospy.rostime.wallsleep(min(due - now, POLL))
                continue
            if now > seen:
                seen, since = now, time.monotonic()
            elif time.monotonic() - since > MISSING_PATIENCE:
                self._report("the time on /clock stands still", lockstep_hint)
            with clock:
                clock.wait(POLL)

    def _step(self, now: float, passed: float) -> None:
        self._last, arrival = self._joints.look()
        if trouble := self._trouble(now - arrival):
            self._report(f"{trouble}: the robot is stopped")
            self._publish(self._pilot.stop(self._last))
            return
        if self._commanded is not None and not 0.0 <= now - self._commanded <= COMMANDED:
            self._wanted, self._commanded = STANDING, None
        self._aim_if_told()
        commands = self._pilot.step(passed, self._last, self._sensors.read(now - passed))
        if commands is None:
            self._report("an episode would be over here: the robot is stopped")
            commands = self._pilot.stop(self._last)
        else:
            self._report("")
        self._publish(commands)

    def _trouble(self, age: float) -> str:
        """Returns why the policy can't move the robot now, for joint states of an age [s]; or nothing."""
        if fault := self._joints.fault():
            return fault
        if age > self._late:
            return f"no joint state on {self._joints.topic} for {self._late:g} s"
        if trouble := self._sensors.trouble(self._late):
            return trouble
        if unheard := self._unheard():
            return f"nobody listens to {', '.join(unheard)} any more"
        return self._controllers.trouble

    def _aim_if_told(self) -> None:
        goal, self._wanted = self._wanted, None
        if goal is None:
            return
        try:
            self._pilot.aim(goal)
            if goal != self._logged:
                rospy.loginfo(f"the goal is {list(goal)}")
                self._logged = goal
        except ValueError as error:
            rospy.logwarn(f"{error}; it keeps the one it has")

    def _report(self, reason: str, hint: Callable[[], str] = str) -> None:
        """Logs why the robot stands still, with a hint, or that it moves again; at most a line a second."""
        self._unreported += reason != self._reason
        self._reason = reason
        if reason == self._reported or time.monotonic() < self._next_report:
            return
        log = rospy.logwarn if reason else rospy.loginfo
        others = f" ({self._unreported - 1} other changes before)" if self._unreported > 1 else ""
        log((f"{reason}{hint()}" or "continuing") + others)
        self._reported, self._unreported = reason, 0
        self._next_report = time.monotonic() + REPORTING

    def _publish(self, commands: Mapping[str, Command]) -> None:
        for name, command in commands.items():
            self._topics[name].publish(self._ports[name].kind.write(command))

    def _end(self) -> None:
        """Stops the robot, if it has moved."""
        if self._last is None:
            return
        newest = self._last if self._joints.missing() else self._joints.look()[0]
        commands = self._pilot.stop(newest)
        # The first message may wait behind an earlier command; the second one is sent after it.
        for _ in range(2):
            sent = self._sent()
            self._publish(commands)
            deadline = time.monotonic() + SENDING
            # rospy drops what its threads haven't sent when the node ends.
            while time.monotonic() < deadline:
                now = self._sent()
                if all(now[each] > count for each, count in sent.items() if each in now):
                    break
                rospy.rostime.wallsleep(0.002)
        rospy.loginfo("the robot is stopped")

    def _sent(self) -> dict[tuple[str, int], int]:
        """Returns how many messages each listener was sent, by topic and connection."""
        return {
            (name, connection.id): connection.stat_num_msg
            for name, topic in self._topics.items()
            for connection in topic.impl.connections
        }


def _late(robot: Robot, period: float) -> float:
    """Returns how long a robot may be without a joint state [s], for a control period [s]."""
    drives = any(port.quantity == TWIST for port in robot.ports)
    return max(min(LATE_PERIODS * period, LATE_AT_MOST if drives else math.inf), LATE_AT_LEAST)


def run_node(
    name: str, argv: list[str], make: Callable[[], PolicyNode], should_end: Callable[[], bool]
) -> None:
    """Makes this process a node, whose remappings `argv` has, and runs the `PolicyNode` that `make` makes."""
    if not node.master_is_up():
        raise RobotEnvError(f"there is no ROS master at {rosgraph.get_master_uri()}: start the robot's")
    node.refuse_twin(name)
    rospy.init_node(os.path.basename(name), argv=["", *argv], disable_signals=True)
    try:
        make().run(should_end)
    finally:
        rospy.signal_shutdown("the policy has ended")
