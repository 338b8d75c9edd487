"""The command shown_joints.py: joint states for RViz, from the first moment and thirty times a second.

RViz draws a link white, and at the wrong place, until it knows where the link is, and joint states come
only while simulated time passes: in a paused world, and in one in lock-step, maybe never. So the joints are
asked for once, by a service that answers while paused too. Later states are handed on, the newest first;
those of joint_state_publisher, which only has zeros, are not. The topic is latched, for who comes later.
"""

import contextlib
import threading
import time
from collections.abc import Iterator, Sequence

import rospy
from gazebo_msgs.srv import GetJointProperties
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.files.urdf import parse_urdf
from ros_calls.service import ServiceClient, ServiceFailed

NAME = "shown_joints"
PERIOD = 1.0 / 30.0  # [s of wall time]
PATIENCE = 1.0  # [s of wall time] from one question to the next, as long as the robot isn't there


class ShownJoints:
    """Hands joint states on from /joint_states to ~joint_states."""

    def __init__(self) -> None:
        self._newest: JointState | None = None
        self._news = threading.Event()
        self._publisher = rospy.Publisher("~joint_states", JointState, queue_size=1, latch=True)
        rospy.Subscriber("/joint_states", JointState, self._receive, queue_size=1)

    def _receive(self, message: JointState) -> None:
        if message.velocity:  # joint_state_publisher has none
            self._newest = message
            self._news.set()

    def run(self) -> None:
        """Until the node is shut down."""
        names = _movable()
        self._publish(names, [0.0] * len(names))
        while not rospy.is_shutdown() and self._newest is None:
            asked = dict(_asked_for(names))
            if len(asked) == len(names):
                self._publish(names, list(asked.values()))
                break
            self._news.wait(PATIENCE)
        while not rospy.is_shutdown():
            if self._news.wait(PATIENCE):
                self._news.clear()
                assert self._newest is not None
                self._publish(self._newest.name, self._newest.position)
                time.sleep(PERIOD)  # no more often; what comes meanwhile is newer

    def _publish(self, names: Sequence[str], positions: Sequence[float]) -> None:
        """In wall time, in which tf and RViz live here: simulated time may stand still or go back."""
        stamp = Header(stamp=rospy.Time.from_sec(time.time()))
        self._publisher.publish(JointState(header=stamp, name=names, position=positions))


def _movable() -> list[str]:
    try:
        description = parse_urdf(rospy.get_param("/robot_description", ""))
    except DescriptionError as error:
        rospy.logwarn("/robot_description: %s", error)
        return []
    return [joint.name for joint in description.movable_joints]


def _asked_for(joints: list[str]) -> Iterator[tuple[str, float]]:
    """Names and positions [rad, m] of the joints that the simulator has."""
    service = ServiceClient("/gazebo/get_joint_properties", GetJointProperties)
    with contextlib.suppress(ServiceFailed):
        for name in joints:
            answer = service(name)
            if answer.success:
                yield name, answer.position[0]


def main() -> int:
    """Runs the node; returns its exit code."""
    rospy.init_node(NAME)
    ShownJoints().run()
    return 0
