"""A client of a trajectory controller, as MoveIt, rqt and rostopic are; it waits in wall time."""

import actionlib
import rospy
from actionlib import CommState
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryGoal,
    JointTrajectoryControllerState,
)
from support.ros.calls import wait_until
from support.ros.subscribed import has_subscribers
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

NAMES = {value: name for name, value in vars(GoalStatus).items() if name.isupper()}


def trajectory(joints, *points, stamp=0.0):
    """Points are (time [s], positions), at rest."""
    message = JointTrajectory(joint_names=joints)
    message.header.stamp = rospy.Time.from_sec(stamp)
    for time, positions in points:
        rest = [0.0] * len(positions)
        message.points.append(JointTrajectoryPoint(positions, rest, rest, [], rospy.Duration.from_sec(time)))
    return message


class Pursuit:
    """A goal that was sent.

    It is asked for its state: SimpleActionClient's callbacks miss an answer that is there before send_goal
    has returned.
    """

    def __init__(self, client, goal):
        self.feedback = []
        client.send_goal(goal, feedback_cb=self.feedback.append)
        self._client, self._handle = client, client.gh

    def wait_active(self):
        return wait_until(lambda: self._handle.get_goal_status() == GoalStatus.ACTIVE)

    def has_ended(self):
        return self._handle.get_comm_state() == CommState.DONE

    def wait(self):
        """Returns how it ended: state, error code."""
        if not wait_until(self.has_ended):
            return "nothing yet", None
        return NAMES[self._handle.get_terminal_state()], self.result.error_code

    def cancel(self):
        self._client.cancel_goal()

    @property
    def result(self):
        return self._handle.get_result()

    @property
    def text(self):
        return self._handle.get_goal_status_text()


class Arm:
    """Topics and action of one controller."""

    def __init__(self, name):
        self.states = []
        self.action = actionlib.SimpleActionClient(
            f"{name}/follow_joint_trajectory", FollowJointTrajectoryAction
        )
        self.command = rospy.Publisher(f"{name}/command", JointTrajectory, queue_size=1)
        self._state = rospy.Subscriber(f"{name}/state", JointTrajectoryControllerState, self.states.append)

    def wait_connected(self):
        """Time may stand still, so nothing that waits for it will do."""
        return wait_until(
            lambda: (
                self.action.wait_for_server(rospy.Duration(1e-9))
                and self.command.get_num_connections()
                and has_subscribers(self._state.name)
            )
        )

    def pursue(self, plan, path=(), goal=(), goal_time=0.0):
        request = FollowJointTrajectoryGoal(plan, path, goal, rospy.Duration.from_sec(goal_time))
        return Pursuit(self.action, request)

    def wait_state(self, condition):
        return wait_until(lambda: self.states and condition(self.states[-1]))

    def close(self):
        client = self.action.action_client
        for topic in (self.command, self._state, client.pub_goal, client.pub_cancel,
                      client.status_sub, client.result_sub, client.feedback_sub):  # fmt: skip
            topic.unregister()
