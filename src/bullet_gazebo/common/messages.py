"""Conversions between our records and ROS messages, and the check of numbers in requests."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import genpy
import numpy as np
from bullet_gazebo_msgs.msg import SensorReading, SensorValue
from control_msgs.msg import JointControllerState
from four_wheel_steering_msgs.msg import FourWheelSteering, FourWheelSteeringStamped
from gazebo_msgs.msg import ContactState
from geometry_msgs.msg import (
    Point,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    Vector3,
    Wrench,
    WrenchStamped,
)
from geometry_msgs.msg import Pose as PoseMsg
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from robot_sim.constants import NANOSECONDS
from robot_sim.control.controllers.joint_state import JointStateSample
from robot_sim.control.controllers.pid_controllers import JointControllerSample
from robot_sim.control.controllers.sensor_controllers import SensorSample
from robot_sim.control.controllers.steering import SteeringSample
from robot_sim.control.controllers.vehicle import TwistSample
from robot_sim.control.errors import ControlError
from robot_sim.drives.odometry import OdometrySample
from robot_sim.physics import pose as poses
from robot_sim.physics.pose import Pose
from robot_sim.sensors.imu import InertialSample
from robot_sim.state import ContactPair

LARGEST_NUMBER = 1e12  # in any SI unit; beyond it the engine's arithmetic ends in infinities


def to_time(now: int) -> genpy.Time:
    """Returns the ROS time of `now` [ns]."""
    return genpy.Time(now // NANOSECONDS, now % NANOSECONDS)


def to_pose_msg(pose: Pose) -> PoseMsg:
    return PoseMsg(Point(*pose.position), Quaternion(*pose.orientation))


def to_twist_msg(twist: tuple[poses.Vector, poses.Vector]) -> Twist:
    return Twist(Vector3(*twist[0]), Vector3(*twist[1]))


def from_pose_msg(msg: PoseMsg) -> Pose:
    """Returns the pose with a unit quaternion; an all-zero one means no rotation."""
    p, q = msg.position, msg.orientation
    return Pose((p.x, p.y, p.z), poses.normalized((q.x, q.y, q.z, q.w)))


def from_transform(msg: Transform) -> Pose:
    """Returns the pose, as `from_pose_msg`."""
    return from_pose_msg(PoseMsg(msg.translation, msg.rotation))


def from_twist_msg(msg: Twist) -> tuple[poses.Vector, poses.Vector]:
    return to_vector(msg.linear), to_vector(msg.angular)


def to_vector(msg: Point | Vector3) -> poses.Vector:
    return (msg.x, msg.y, msg.z)


def to_joint_state(sample: JointStateSample) -> JointState:
    return JointState(
        header=Header(stamp=to_time(sample.stamp)),
        name=sample.names,
        position=sample.positions,
        velocity=sample.velocities,
        effort=sample.efforts,
    )


def to_joint_controller_state(sample: JointControllerSample) -> JointControllerState:
    return JointControllerState(Header(stamp=to_time(sample.stamp)), *sample[1:])


def to_odometry(sample: OdometrySample) -> Odometry:
    pose, twist = [0.0] * 36, [0.0] * 36
    pose[::7], twist[::7] = sample.pose_covariance, sample.twist_covariance
    return Odometry(
        Header(stamp=to_time(sample.stamp), frame_id=sample.frame),
        sample.child,
        PoseWithCovariance(to_pose_msg(Pose(sample.position, sample.orientation)), pose),
        TwistWithCovariance(to_twist_msg((sample.linear, sample.angular)), twist),
    )


def to_transform(now: int, frame: str, child: str, pose: Pose) -> TFMessage:
    """Returns the one transform that places `child` at `pose` in `frame`, at the time `now` [ns]."""
    transform = Transform(Vector3(*pose.position), Quaternion(*pose.orientation))
    header = Header(stamp=to_time(now), frame_id=frame)
    return TFMessage([TransformStamped(header, child, transform)])


def to_odometry_transform(sample: OdometrySample) -> TFMessage:
    """Returns the transform of an odometry."""
    pose = Pose(sample.position, sample.orientation)
    return to_transform(sample.stamp, sample.frame, sample.child, pose)


def to_twist_stamped(sample: TwistSample) -> TwistStamped:
    twist = to_twist_msg(((sample.linear, 0.0, 0.0), (0.0, 0.0, sample.angular)))
    return TwistStamped(Header(stamp=to_time(sample.stamp)), twist)


def to_four_wheel_steering(sample: SteeringSample) -> FourWheelSteeringStamped:
    data = FourWheelSteering(
        front_steering_angle=sample.front, rear_steering_angle=sample.rear, speed=sample.speed
    )
    return FourWheelSteeringStamped(Header(stamp=to_time(sample.stamp)), data)


def to_imu(sample: InertialSample, now: int, frame: str, deviation: float = 0.0) -> Imu:
    """Returns the message of a measurement; the covariances are those of the plugin's own noise."""
    diagonal = [deviation**2, 0.0, 0.0, 0.0, deviation**2, 0.0, 0.0, 0.0, deviation**2]
    return Imu(
        header=Header(stamp=to_time(now), frame_id=frame),
        orientation=Quaternion(*sample.orientation),
        orientation_covariance=diagonal,
        angular_velocity=Vector3(*sample.angular_velocity),
        angular_velocity_covariance=diagonal,
        linear_acceleration=Vector3(*sample.linear_acceleration),
        linear_acceleration_covariance=diagonal,
    )


def to_sensor_imu(sample: SensorSample) -> Imu:
    """Returns the message of an IMU that a controller reports; its covariances aren't known."""
    return to_imu(sample.value, sample.stamp, sample.frame)


def to_sensor_wrench(sample: SensorSample) -> WrenchStamped:
    """Returns the message of a force-torque sensor that a controller reports."""
    header = Header(stamp=to_time(sample.stamp), frame_id=sample.frame)
    return WrenchStamped(header, to_wrench_msg(*sample.value))


def to_contact_state(pair: ContactPair) -> ContactState:
    return ContactState(
        collision1_name=pair.first,
        collision2_name=pair.second,
        wrenches=[to_wrench_msg(*wrench) for wrench in pair.wrenches],
        total_wrench=to_wrench_msg(*pair.total),
        contact_positions=[Vector3(*point) for point in pair.points],
        contact_normals=[Vector3(*normal) for normal in pair.normals],
        depths=pair.depths,
    )


def from_contact_state(state: ContactState) -> ContactPair:
    """Returns what a message says of a contact."""
    return ContactPair(
        state.collision1_name,
        state.collision2_name,
        [to_vector(each) for each in state.contact_positions],
        [to_vector(each) for each in state.contact_normals],
        [(to_vector(each.force), to_vector(each.torque)) for each in state.wrenches],
        list(state.depths),
    )


def to_reading(now: int, values: Mapping[str, Any]) -> SensorReading:
    """Converts what a sensor measured at a time [ns]; see `robot_sim.sensors.sensor_reading.Reading`."""
    arrays = [
        SensorValue(name, each.dtype.str, each.shape, each.tobytes())
        for name, each in values.items()
        if isinstance(each, np.ndarray)
    ]
    return SensorReading(now, arrays, [to_contact_state(each) for each in values.get("contacts", ())])


def to_wrench_msg(force: poses.Vector, torque: poses.Vector) -> Wrench:
    return Wrench(Vector3(*force), Vector3(*torque))


def check_numbers(what: str, values: Sequence[float]) -> None:
    """Raises ControlError for a number that isn't finite, or is too large for a world."""
    if all(map(math.isfinite, values)) and max(map(abs, values), default=0.0) <= LARGEST_NUMBER:
        return
    for value in values:
        if not math.isfinite(value):
            raise ControlError(f"{what} has {value}, which is not finite")
        if abs(value) > LARGEST_NUMBER:
            raise ControlError(f"{what} has {value}; it can't be beyond {LARGEST_NUMBER:g}")


def bad_number(message: genpy.Message, largest: float = LARGEST_NUMBER) -> str:
    """Returns which number the world can't take, as "pose.position.x is nan; it must be finite".

    Empty if all are finite and not beyond `largest`.
    """
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        fault = _fault(getattr(message, name), kind, largest)
        if fault:
            return f"{name}{fault}"
    return ""


def _fault(value: object, kind: str, largest: float) -> str:
    if isinstance(value, genpy.Message):
        fault = bad_number(value, largest)
        return fault and f".{fault}"
    if isinstance(value, (list, tuple)):
        for index, item in enumerate(value):
            fault = _fault(item, kind.partition("[")[0], largest)
            if fault:
                return f"[{index}]{fault}"
    if kind in ("float32", "float64") and isinstance(value, float):
        if not math.isfinite(value):
            return f" is {value}; it must be finite"
        if abs(value) > largest:
            return f" is {value}; it can't be beyond {largest:g}"
    return ""
