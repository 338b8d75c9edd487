"""libgazebo_ros_p3d.so: the true state of a link (docs/contract/sensors.md 6b)."""

from geometry_msgs.msg import Point, PoseWithCovariance, Quaternion, TwistWithCovariance
from geometry_msgs.msg import Pose as PoseMsg
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from bullet_gazebo.common.messages import to_time, to_twist_msg
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import SensorPlugin, TopicSource
from robot_sim.physics.files.elements import numbers
from robot_sim.physics.pose import add, conjugate, from_rpy, multiply, rotate, subtract
from robot_sim.sensors.imu import LinkMotion, motion_of

WORLDS = ("world", "/world", "map", "/map")


class P3dPlugin(SensorPlugin):
    """Publishes where a link is and how fast it moves, in the world or as seen from another link."""

    source = TopicSource(Odometry)

    def __init__(self, context: PluginContext) -> None:
        self._link, self._child = context.link("bodyName"), context.text("bodyName", "")
        frame = context.text("frameName", "world")
        self._reference = None if frame in WORLDS else context.link_in_world("frameName")
        self._xyz = numbers(context.text("xyzOffset", "0 0 0"), "<xyzOffset>", 3)
        self._turn = from_rpy(*numbers(context.text("rpyOffset", "0 0 0"), "<rpyOffset>", 3))
        self._deviation = context.deviation()
        super().__init__(context)

    def rate(self) -> float:
        return self.context.rate()

    def measure(self, now: int) -> Odometry:
        pose, linear, angular = self._relative(motion_of(self.context.model, self._link))
        x, y, z = self._xyz
        place, turn = add(pose.position, (x, y, z)), multiply(self._turn, pose.orientation)
        if self._deviation:
            draws = self.context.random(now).normal(0.0, self._deviation, 6).tolist()
            linear = add(linear, (draws[0], draws[1], draws[2]))
            angular = add(angular, (draws[3], draws[4], draws[5]))
        covariance = [0.0] * 36
        covariance[::7] = [self._deviation**2] * 6
        return Odometry(
            Header(stamp=to_time(now), frame_id=self.frame),
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
