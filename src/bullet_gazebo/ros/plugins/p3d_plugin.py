"""libgazebo_ros_p3d.so: the true state of a link (docs/contract/sensors.md 6b).

`bodyName` and `topicName` are required. `frameName` (world), `xyzOffset`, `rpyOffset`, `gaussianNoise` (0)
and `updateRate` (0: every step) are read. The twist is in world axes.
"""

from geometry_msgs.msg import Point, PoseWithCovariance, Quaternion, TwistWithCovariance
from geometry_msgs.msg import Pose as PoseMsg
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from bullet_gazebo.physics.files.elements import numbers
from bullet_gazebo.physics.pose import add, conjugate, from_rpy, multiply, rotate, subtract
from bullet_gazebo.ros.common.messages import to_time, to_twist_msg
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    SensorPlugin,
    SensorTopic,
    frame_of,
    namespace_of,
    topic_in,
)
from bullet_gazebo.sensors.imu import LinkMotion, motion_of

WORLDS = ("world", "/world", "map", "/map")


class P3dPlugin(SensorPlugin):
    """Publishes where a link is and how fast it moves, in the world or as seen from another link."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._link, self._child = context.link("bodyName"), context.text("bodyName", "")
        topic = context.required("topicName")
        frame = context.text("frameName", "world")
        self._reference = None if frame in WORLDS else context.link_in_world("frameName")
        self._xyz = numbers(context.text("xyzOffset", "0 0 0"), "<xyzOffset>", 3)
        self._turn = from_rpy(*numbers(context.text("rpyOffset", "0 0 0"), "<rpyOffset>", 3))
        self._deviation = context.deviation()
        namespace = namespace_of(context, absent="", empty="/")
        self._frame = frame_of(namespace, frame)
        rate = context.rate()
        SensorTopic(context, topic_in(namespace, topic), Odometry, rate, self._measure)

    def _measure(self, now: int) -> Odometry:
        pose, linear, angular = self._relative(motion_of(self._context.model, self._link))
        x, y, z = self._xyz
        place, turn = add(pose.position, (x, y, z)), multiply(self._turn, pose.orientation)
        if self._deviation:
            random = self._context.sensing.noise(self._context.model, self._context.key, now)
            draws = random.normal(0.0, self._deviation, 6).tolist()
            linear = add(linear, (draws[0], draws[1], draws[2]))
            angular = add(angular, (draws[3], draws[4], draws[5]))
        covariance = [0.0] * 36
        covariance[::7] = [self._deviation**2] * 6
        return Odometry(
            Header(stamp=to_time(now), frame_id=self._frame),
            self._child,
            PoseWithCovariance(PoseMsg(Point(*place), Quaternion(*turn)), covariance),
            TwistWithCovariance(to_twist_msg((linear, angular)), covariance),
        )

    def _relative(self, motion: LinkMotion) -> LinkMotion:
        """Returns a motion as seen from the link `frameName`, in the way of the original."""
        if self._reference is None:
            return motion
        frame = motion_of(*self._reference)
        back = conjugate(frame.pose.orientation)
        pose = motion.pose._replace(
            position=rotate(back, subtract(motion.pose.position, frame.pose.position)),
            orientation=multiply(motion.pose.orientation, back),
        )
        turn = frame.pose.orientation
        linear = rotate(turn, subtract(motion.linear, frame.linear))
        return LinkMotion(pose, linear, rotate(turn, subtract(motion.angular, frame.angular)))


LIBRARIES = {"libgazebo_ros_p3d.so": P3dPlugin}
