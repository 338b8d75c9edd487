"""libgazebo_ros_control.so: ros_control for a model (docs/contract/gazebo_ros_control.md 6.1 to 6.5)."""

import logging
import threading
import time
import traceback
from contextlib import ExitStack
from http.client import HTTPException

import rosgraph
import rospy
from std_msgs.msg import Bool

from bullet_gazebo.control.controller_services import ControllerServices
from bullet_gazebo.control.controller_topics import PidTopics
from bullet_gazebo.plugins.plugin_loader import PluginContext
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import GAINS, RobotHardware
from robot_sim.control.manager import ControllerManager
from robot_sim.control.transmissions import read_description
from robot_sim.physics.description import CONTROL_PLUGIN
from robot_sim.robot import ControlledRobot, control_period_of
from robot_sim.sensors.sensor_readers import offer_sensors

POLL = 0.1  # [s]
SIM_TYPE = "gazebo_ros_control/DefaultRobotHWSim"
REMIND = 10.0  # [s]


class ControlPlugin:
    """Makes a controller manager for a model as soon as its robot description is on the server."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._sim = context.sim
        self._namespace = rospy.names.ns_join(rospy.get_namespace(), context.namespace)
        self._parameter = context.text("robotParam", "robot_description")
        self._gone = threading.Event()
        self._lock = threading.Lock()
        self._started = ExitStack()  # what shutdown() ends, the last one first
        if not self._try_start():
            threading.Thread(target=self._wait_and_start, name="robot_description", daemon=True).start()

    def shutdown(self) -> None:
        self._gone.set()
        with self._lock:
            self._started.close()

    def _wait_and_start(self) -> None:
        """Waits for the robot description. Gazebo blocks the world meanwhile; here only this model waits."""
        reminder = time.monotonic() + REMIND
        while not self._gone.wait(POLL) and not rospy.is_shutdown() and not self._try_start():
            if time.monotonic() >= reminder:
                reminder += REMIND
                rospy.logwarn(
                    "gazebo_ros_control of model '%s' still waits for the parameter '%s' (from %s up)",
                    self._context.model.name, self._parameter, self._namespace,
                )  # fmt: skip

    def _try_start(self) -> bool:
        """Returns False while there is no robot description; a broken one is reported, once."""
        try:
            text = find_param(self._namespace, self._parameter)
        except (OSError, HTTPException):  # no master; it may come back
            return False
        if not text:
            return False
        with self._lock:
            if not self._gone.is_set():
                try:
                    self._start(str(text))
                except Exception as error:  # noqa: BLE001 - this robot has no control, all others continue
                    self._started.close()
                    known = isinstance(error, ControlError)
                    rospy.logfatal(
                        "gazebo_ros_control of model '%s' can't start, so this robot has no control here: %s",
                        self._context.model.name,
                        error if known else "".join(traceback.format_exception(error)),
                    )
        return True

    def _start(self, text: str) -> None:
        if not rosgraph.names.is_legal_name(self._namespace):
            raise ControlError(f"'{self._namespace}' is not a legal namespace")
        kind = self._context.text("robotSimType", SIM_TYPE)
        if kind != SIM_TYPE:
            rospy.logwarn(
                "Model '%s': the <robotSimType> %s is not simulated: its joints are moved by %s",
                self._context.model.name, kind, SIM_TYPE,
            )  # fmt: skip
        hardware = self._hardware(text)
        manager = ControllerManager(hardware)
        with self._sim.lock:
            model, period = self._context.model, self._control_period()
            robot = ControlledRobot(model, hardware, manager, period, self._namespace, _log)
        thinner = self._context.thinner
        self._started.callback(self._offer(manager).shutdown)
        for place, pid in hardware.pids.items():
            full = rospy.names.ns_join(self._namespace, place)
            topics = PidTopics(self._sim, thinner, pid, full, manager.loops_changed)
            self._started.callback(topics.shutdown)
        with self._sim.lock:
            self._sim.add_robot(robot)
        self._started.callback(self._remove, robot)
        self._listen_to_emergency_stop(robot)
        rospy.loginfo("Loaded gazebo_ros_control for model '%s'.", self._context.model.name)

    def _hardware(self, text: str) -> RobotHardware:
        """Returns what the robot description and the parameters say, with the model's sensors."""
        limits = rospy.get_param(rospy.names.ns_join(self._namespace, "joint_limits"), {})
        description = read_description(text).limited_by(limits)
        for warning in description.warnings:
            rospy.logwarn("gazebo_ros_control: %s", warning)
        gains = rospy.get_param(rospy.names.ns_join(self._namespace, GAINS), {})
        hardware = RobotHardware(description, gains if isinstance(gains, dict) else {})
        offer_sensors(hardware, self._sim, self._context.model, self._context.sensing)
        return hardware

    def _remove(self, robot: ControlledRobot) -> None:
        with self._sim.lock:
            self._sim.remove_robot(robot)

    def _control_period(self) -> float:
        """Returns `<controlPeriod>` [s], after a message if it is shorter than the physics step."""
        period = control_period_of(self._context.plugin)
        if 0.0 < period < self._sim.world.time_step:
            rospy.logerr(
                "The control period %g s is shorter than the step of %g s, which is used.",
                period, self._sim.world.time_step,
            )  # fmt: skip
        return period

    def _listen_to_emergency_stop(self, robot: ControlledRobot) -> None:
        """Subscribes to `<eStopTopic>` (docs/contract/gazebo_ros_control.md 6.7)."""
        topic = self._context.text("eStopTopic", "")
        if not topic:
            return

        def receive(message: Bool) -> None:
            with self._sim.lock:
                robot.emergency_stop(message.data)

        full = rospy.names.ns_join(self._namespace, topic)
        self._started.callback(rospy.Subscriber(full, Bool, receive, queue_size=1).unregister)

    def _offer(self, manager: ControllerManager) -> ControllerServices:
        try:
            return ControllerServices(self._sim, self._context.thinner, manager, self._namespace)
        except rospy.service.ServiceException as error:
            raise ControlError(
                f"there is a controller manager in the namespace '{self._namespace}' already; "
                "give each robot a robot_namespace of its own"
            ) from error


def _log(level: int, text: str) -> None:
    log = rospy.logwarn if level >= logging.WARNING else rospy.loginfo
    log("gazebo_ros_control: %s", text)


def find_param(namespace: str, name: str) -> object:
    """Returns parameter `name`, looked for in `namespace` and upwards; None if there is none."""
    if name.startswith("/"):
        return rospy.get_param(name, None)
    while True:
        value = rospy.get_param(rospy.names.ns_join(namespace, name), None)
        if value or namespace in ("", "/"):
            return value
        namespace = namespace.rstrip("/").rpartition("/")[0] or "/"


LIBRARIES = {CONTROL_PLUGIN: ControlPlugin}
