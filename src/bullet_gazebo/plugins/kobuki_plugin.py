"""libgazebo_ros_kobuki.so: the base of TurtleBot 2 (docs/contract/sensors.md 12.4)."""

import math
from collections.abc import Callable
from functools import partial

import rospy
from kobuki_msgs.msg import BumperEvent, CliffEvent, MotorPower, SensorState, WheelDropEvent
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Empty, Header

from bullet_gazebo.common.messages import to_imu, to_time
from bullet_gazebo.plugins.drive_topics import REST, DrivePlugin, Wheels, choice, length
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import (
    MODEL,
    SensorTopic,
    advertised,
    namespace_of,
    subscribe,
    topic_in,
)
from robot_sim.constants import NANOSECONDS
from robot_sim.drives.odometry import TWIST, DeadReckoning, OdometrySample, Triple
from robot_sim.drives.wheels import side_speeds
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.pose import conjugate, rotate, subtract
from robot_sim.sensors.contact import ContactSensor
from robot_sim.sensors.imu import ImuSensor
from robot_sim.sensors.laser import LaserSensor
from robot_sim.sensors.sensing import Mount
from robot_sim.sensors.sensor_readers import WITHOUT
from robot_sim.state_dict import Stateful

BUMPER = (0.01, 0.13)  # [m] above the base, where it is felt
POSE = (0.1, 0.1, 1e6, 1e6, 1e6, 0.05)
CORE_RATE = 50.0  # [Hz]
SIDES = ("left", "center", "right")  # LEFT, CENTER, RIGHT of the messages
BITS = (4, 2, 1)  # of the sides in SensorState


class KobukiPlugin(DrivePlugin):
    """Two wheels; odometry takes the distance from them, and the angle from the IMU."""

    def __init__(self, context: PluginContext) -> None:
        namespace = namespace_of(context, MODEL, MODEL)
        super().__init__(context, namespace, context.rate("update_rate"), late=False)
        prefix = rospy.get_param(topic_in(namespace, "base_prefix"), "mobile_base")
        below = partial(topic_in, topic_in(namespace, str(prefix)))
        wheels = {tag: context.required(tag) for tag in _tags("{}_wheel_joint_name", _EDGES)}
        diameter, torque = length(context, "wheel_diameter", 0.0), context.number("torque", 0.0)
        self._wheels = Wheels(context, wheels, diameter, torque)
        self._separation = length(context, "wheel_separation", 0.0)
        self._patience = context.number("velocity_command_timeout", 0.0)  # [s]
        self._place, self._turning = DeadReckoning(), 0.0  # [rad/s]
        self._commanded, self._has_power = self.sim.now, True
        self._joint_states = advertised(context, topic_in(namespace, "joint_states"), JointState, 1)
        self._imu = ImuSensor(_mount(context, "imu_name", "imu"))
        self._imu.start()
        self._imu_data = advertised(context, below("sensors/imu_data"), Imu, 1)
        context.clock(self._imu.rate, self._turn)
        self._senses = _Senses(context, below)
        for name, kind, receive in (
            ("motor_power", MotorPower, self._switch), ("reset_odometry", Empty, self._reset),
        ):  # fmt: skip
            subscribe(context, below(f"commands/{name}"), kind, receive, 10)
        self.begin(tf=choice(context, "publish_tf", False), command=below("commands/velocity"))

    def take(self, command: Triple) -> None:
        super().take(command)
        self._commanded = self.sim.now

    def update(self, now: int) -> None:
        seconds = self.sim.world.time_step
        self._place.move(self._ahead() * seconds, self._turning * seconds)
        if self.period.is_over(now):
            self.report(now)
            if self._joint_states.has_subscribers:
                self._joint_states.publish(self._joint_state(now))
        is_late = 0.0 < self._patience * NANOSECONDS < now - self._commanded
        if is_late or not self._has_power:
            self.command = REST
        ahead, _, turn = self.command
        self._wheels.drive(side_speeds(ahead, turn, self._separation))

    def sample(self, now: int) -> OdometrySample:
        place = self._place
        return OdometrySample(
            now, self.frame, self.child, place.position, place.orientation,
            (self._ahead(), 0.0, 0.0), (0.0, 0.0, self._turning), POSE, TWIST,
        )  # fmt: skip

    def restart(self) -> None:
        self._place.restart()
        self._turning, self._commanded = 0.0, self.sim.now
        self._wheels.drive((0.0, 0.0))

    def _ahead(self) -> float:
        return 0.5 * sum(self._wheels.speeds)  # [m/s]

    def _turn(self, now: int) -> None:
        sample = self._imu.measure(now)
        if sample is not None:
            self._turning = sample.angular_velocity[2]
            if self._imu_data.has_subscribers:
                self._imu_data.publish(to_imu(sample, now, self.child, self._imu.deviation))

    def _joint_state(self, now: int) -> JointState:
        names = [joint.name for joint in self._wheels.joints]
        positions, velocities = zip(*map(self.model.joint_state, names), strict=True)
        return JointState(Header(stamp=to_time(now)), names, positions, velocities, [0.0, 0.0])

    def _switch(self, message: MotorPower) -> None:
        with self.sim.lock:
            self._has_power = message.state == MotorPower.ON

    def _reset(self, _: Empty) -> None:
        with self.sim.lock:
            self._place.restart()


class _Senses(Stateful):
    """Cliffs, bumpers and dropped wheels: an event for each change, and all of them in `sensors/core`."""

    non_persistent = ("_events", "_down", "_bumper", "_wheels")

    def __init__(self, context: PluginContext, below: Callable[[str], str]) -> None:
        self._model = context.model
        none = False, False, False
        self._state: dict[str, tuple[bool, ...]] = {"bumper": none, "cliff": none}
        self._state["wheel_drop"] = (False, False)
        SensorTopic(context, below("sensors/core"), SensorState, CORE_RATE, self._core)
        self._events = {
            name: advertised(context, below(f"events/{name}"), kind, 10)
            for name, kind in (("bumper", BumperEvent), ("cliff", CliffEvent), ("wheel_drop", WheelDropEvent))
        }
        self._threshold = length(context, "cliff_detection_threshold", 0.0)  # [m]
        tags = _tags("cliff_sensor_{}_name", SIDES)
        self._down = [LaserSensor(_mount(context, tag, "ray")) for tag in tags]
        context.clock(self._down[0].rate, self._cliffs)
        self._bumper = ContactSensor(_mount(context, "bumper_name", "contact"))
        context.clock(self._bumper.rate, self._bumps)
        drops = _tags("wheel_drop_{}_sensor_name", _EDGES)
        if any(context.text(tag, "") for tag in drops):
            self._wheels = [ContactSensor(_mount(context, tag, "contact")) for tag in drops]
            context.clock(self._wheels[0].rate, self._drops)

    def _changed(self, name: str, found: tuple[bool, ...]) -> list[int]:
        """Returns the sides that have changed."""
        before, self._state[name] = self._state[name], found
        return [side for side, new in enumerate(found) if new != before[side]]

    def _cliffs(self, now: int) -> None:
        # What meets nothing is deep.
        deep = [min(float(each.measure(now).ranges.min()), 65.0) for each in self._down]
        over_cliff = tuple(each > self._threshold for each in deep)
        for side in self._changed("cliff", over_cliff):
            event = CliffEvent(side, over_cliff[side], round(1e3 * max(deep[side], 0.0)))
            self._events["cliff"].publish(event)

    def _bumps(self, now: int) -> None:
        if self._bumper.is_stale(now):
            return
        pressed = set()
        base = self._model.state()[0]
        back = conjugate(base.orientation)
        for pair in self._bumper.measure(now):
            for point, normal in zip(pair.points, pair.normals, strict=True):
                height = rotate(back, subtract(point, base.position))[2]
                x, y, _ = rotate(back, normal)  # towards the bumper
                # Sectors of 60 degrees: left, centre, right.
                side = round(1.0 - math.degrees(math.atan2(-y, -x)) / 60.0)
                if BUMPER[0] < height < BUMPER[1] and side in (0, 1, 2):
                    pressed.add(side)
        touched = tuple(side in pressed for side in range(3))
        for side in self._changed("bumper", touched):
            self._events["bumper"].publish(BumperEvent(side, touched[side]))

    def _drops(self, now: int) -> None:
        if self._wheels[0].is_stale(now):
            return
        dropped = tuple(not each.measure(now) for each in self._wheels)
        for side in self._changed("wheel_drop", dropped):
            self._events["wheel_drop"].publish(WheelDropEvent(side, dropped[side]))

    def _core(self, now: int) -> SensorState:
        message = SensorState(header=Header(stamp=to_time(now)), time_stamp=now // 1_000_000 % 65536)
        for name, states in self._state.items():
            bits = BITS[-len(states) :]  # of two wheels the right one has the lowest bit
            setattr(message, name, sum(bit for bit, on in zip(bits, states, strict=True) if on))
        return message


_EDGES = ("left", "right")


def _tags(pattern: str, sides: tuple[str, ...]) -> list[str]:
    return [pattern.format(side) for side in sides]


def _mount(context: PluginContext, tag: str, kind: str) -> Mount:
    """Returns the place of the model's sensor that an element names."""
    name = context.required(tag)
    for sensor in context.model.description.sensors:
        if sensor.name == name and sensor.kind == kind:
            return Mount(context.sim, context.model, WITHOUT, context.sensing, sensor)
    raise DescriptionError(f"<{tag}>: the model has no sensor '{name}' of type {kind}")


LIBRARIES = {"libgazebo_ros_kobuki.so": KobukiPlugin}
