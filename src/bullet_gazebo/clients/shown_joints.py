"""The command shown_joints.py: a robot's joint states and place for RViz, thirty times a second.

RViz draws a link white, and at the wrong place, until it knows where the link is. Joint states come only
while simulated time passes, in a paused world or in lock-step maybe never. So until one comes, this node
asks the simulator by a service that also answers while paused. Then it forwards the newest state, except
joint_state_publisher's, which are zeros.

No node publishes the pose of a robot that isn't fixed to the world to tf: this one asks the simulator for it,
and publishes the transform from world to the root link.
"""

import contextlib
import threading
import time
from collections.abc import Sequence

import rospy
from gazebo_msgs.srv import GetJointProperties, GetLinkState, GetWorldProperties
from geometry_msgs.msg import Pose, Transform, TransformStamped, Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from robot_sim.physics.description import DescriptionError, Joint, ModelDescription
from robot_sim.physics.files.urdf import parse_urdf
from ros_calls.service import ServiceClient, ServiceFailed

NAME = "shown_joints"
WORLD = "world"
PERIOD = 1.0 / 30.0  # [s of wall time]
ASKING = 0.1  # [s of wall time] between two questions while no joint states come
STATES_PATIENCE = 1.0  # [s of wall time] for a missing robot, or joint states that don't change


class ShownJoints:
    """Forwards a robot's joint states from /joint_states to ~joint_states."""

    def __init__(self, joints: Sequence[Joint]) -> None:
        self._joints = joints
        self._ask = ServiceClient("/gazebo/get_joint_properties", GetJointProperties, persistent=True)
        self._newest: JointState | None = None
        self._news = threading.Event()
        self._publisher = rospy.Publisher("~joint_states", JointState, queue_size=1, latch=True)
        rospy.Subscriber("/joint_states", JointState, self._receive, queue_size=1)

    def _receive(self, message: JointState) -> None:
        if message.velocity:  # joint_state_publisher has none
            self._newest = message
            self._news.set()

    def run(self) -> None:
        """Publishes until the node is shut down."""
        names: Sequence[str] = [joint.name for joint in self._joints]
        positions: Sequence[float] = [0.0] * len(names)
        while not rospy.is_shutdown():
            # Also without news: RViz, or the node that makes tf of them, may have come just now.
            state = JointState(header=_now(), name=names, position=positions)
            self._publisher.publish(state)
            time.sleep(PERIOD)  # no more often; only the newest state counts
            if self._news.wait(ASKING if self._newest is None else STATES_PATIENCE):
                self._news.clear()
                assert self._newest is not None
                names, positions = self._newest.name, self._newest.position
            elif self._newest is None:
                positions = self._asked(names) or positions

    def _asked(self, names: Sequence[str]) -> list[float]:
        """Returns the joints' positions [rad, m]; empty while the simulator lacks one of them."""
        positions = []
        with contextlib.suppress(ServiceFailed):
            for name in names:
                answer = self._ask(name)
                if not answer.success:
                    return []
                positions.append(answer.position[0])
        return positions if len(positions) == len(names) else []


class ShownBase:
    """Publishes the root link's pose to ~tf, for a robot that isn't fixed to the world."""

    def __init__(self, root: str) -> None:
        self._root = root
        self._model = ""  # with that link; empty while unknown
        self._last = rospy.Time()  # of what is published: tf refuses a second one of the same
        self._publisher = rospy.Publisher("~tf", TFMessage, queue_size=1)
        self._models = ServiceClient("/gazebo/get_world_properties", GetWorldProperties)
        self._state = ServiceClient("/gazebo/get_link_state", GetLinkState, persistent=True)

    def run(self) -> None:
        """Publishes until the node is shut down."""
        while not rospy.is_shutdown():
            pose = None
            with contextlib.suppress(ServiceFailed):
                pose = self._pose()
            if pose is not None:
                self._publish(pose)
            time.sleep(STATES_PATIENCE if pose is None else PERIOD)

    def _pose(self) -> Pose | None:
        """Returns the link's pose in the world, or None while no model has it."""
        for model in [self._model] if self._model else self._models().model_names:
            answer = self._state(f"{model}::{self._root}", WORLD)
            if answer.success:
                self._model = model
                return answer.link_state.pose
        self._model = ""
        return None

    def _publish(self, pose: Pose) -> None:
        place, turn = pose.position, pose.orientation
        there = Transform(Vector3(place.x, place.y, place.z), turn)
        header = _now(WORLD)
        if header.stamp != self._last:
            self._last = header.stamp
            self._publisher.publish(TFMessage([TransformStamped(header, self._root, there)]))


def _now(frame: str = "") -> Header:
    """Stamps with wall time, where simulated time may stand still, or as measurements are stamped."""
    simulated = rospy.get_param_cached("~use_sim_time", False)
    now = rospy.Time.now() if simulated else rospy.Time.from_sec(time.time())
    return Header(stamp=now, frame_id=frame)


def _described() -> ModelDescription | None:
    try:
        return parse_urdf(rospy.get_param("/robot_description", ""))
    except DescriptionError as error:
        rospy.logwarn("/robot_description: %s", error)
        return None


def main() -> int:
    """Runs the node; returns its exit code."""
    rospy.init_node(NAME)
    robot = _described()
    if robot is not None and not robot.fixed_base:
        threading.Thread(target=ShownBase(robot.root).run, daemon=True).start()
    ShownJoints(robot.movable_joints if robot is not None else []).run()
    return 0
