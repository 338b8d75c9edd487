"""JointTrajectoryController through ROS (docs/contract/ros_control.md 3.5)."""

import math

import rosgraph
import rosnode
import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from control_msgs.msg import JointTolerance
from control_msgs.srv import QueryTrajectoryState
from support.ros.calls import call, delete_model, gazebo, joint, wait_until
from support.ros.manager import STRICT, Manager
from support.ros.world_case import WorldCase
from trajectory_client import Arm, trajectory

EFFORT = ["effort_a", "effort_b"]
RESULTS = {"SUCCEEDED": 0, "INVALID_GOAL": -1, "INVALID_JOINTS": -2, "PATH": -4, "GOAL": -5}
STATUS = "/slides/effort_arm/follow_joint_trajectory/status"
ACTION = {"goal", "cancel", "status", "feedback", "result"}


def topics_below(namespace):
    state = rosgraph.Master(rospy.get_name()).getSystemState()
    own = rospy.get_name()
    return {
        topic
        for group in state[:2]
        for topic, nodes in group
        if topic.startswith(namespace) and set(nodes) != {own}
    }


class TrajectoryTest(WorldCase):
    def setUp(self):
        gazebo("pause_physics")
        self.spawn("slides", rospy.get_param("/slides/robot_description"), "")
        self.manager = Manager("/slides")

    def arm(self, name="effort_arm", start=True):
        """Loads a controller, and starts it, while the world is paused."""
        self.assertTrue(self.manager.load(name))
        if start:
            self.assertTrue(self.manager.switch([name], [], STRICT))
        arm = Arm(f"/slides/{name}")
        self.addCleanup(arm.close)
        self.assertTrue(arm.wait_connected(), name)
        return arm

    def check(self, pursuit, state, result, text=""):
        self.assertEqual(pursuit.wait(), (state, RESULTS[result]))
        self.assertIn(text, pursuit.result.error_string)

    # the way of each interface

    def test_all_three_interfaces_follow_a_trajectory(self):
        for name, joints in (
            ("effort_arm", EFFORT),
            ("position_arm", ["position_a", "position_b"]),
            ("velocity_arm", ["velocity_a"]),
        ):
            with self.subTest(name):
                arm = self.arm(name)
                gazebo("unpause_physics")
                tolerance = [JointTolerance(name=each, position=0.01) for each in joints]
                wanted = [0.2, -0.1][: len(joints)]
                plan = trajectory(joints, (0.0, [0.0] * len(joints)), (0.5, wanted))
                pursuit = arm.pursue(plan, path=tolerance, goal=tolerance)
                self.check(pursuit, "SUCCEEDED", "SUCCEEDED")
                self.assertGreaterEqual(len(pursuit.feedback), 8)
                for each, place in zip(joints, wanted, strict=True):
                    self.assertAlmostEqual(joint(each)[0], place, delta=0.01)
                gazebo("pause_physics")

    # goals that fail

    def test_path_tolerance(self):
        arm = self.arm()
        gazebo("unpause_physics")
        tolerance = [JointTolerance(name="effort_a", position=0.001)]
        pursuit = arm.pursue(trajectory(EFFORT, (0.1, [2.0, 0.0])), path=tolerance)
        self.check(pursuit, "ABORTED", "PATH", "effort_a path error 0.0")
        self.assertEqual(pursuit.text, pursuit.result.error_string)
        # The way goes on all the same.
        self.assertTrue(wait_until(lambda: abs(joint("effort_a")[0] - 2.0) < 0.05))

    def test_wrong_joints(self):
        arm = self.arm()
        for joints in (["effort_a"], ["effort_a", "elbow"], ["effort_a", "effort_b", "x"], []):
            with self.subTest(joints):
                plan = trajectory(joints, (1.0, [0.0] * len(joints)))
                self.check(arm.pursue(plan), "REJECTED", "INVALID_JOINTS", "joints don't match")

    def test_states_and_query_state_tell_the_way(self):
        arm = self.arm()
        gazebo("unpause_physics")
        self.assertTrue(wait_until(lambda: arm.states))
        start = arm.states[-1].header.stamp + rospy.Duration(1)
        arm.command.publish(trajectory(EFFORT, (1.0, [1.0, 0.0]), stamp=start.to_sec()))

        def ask(seconds):
            time = start + rospy.Duration.from_sec(seconds)
            return call("/slides/effort_arm/query_state", QueryTrajectoryState, time)

        self.assertTrue(wait_until(lambda: ask(9.0).position == (0.0, 1.0)))
        middle = ask(0.5)
        self.assertEqual(middle.name, EFFORT[::-1])
        self.assertAlmostEqual(middle.position[1], 0.5, places=6)
        self.assertAlmostEqual(middle.velocity[1], 1.875, places=6)
        self.assertTrue(arm.wait_state(lambda state: state.actual.velocities[1] > 0.3))
        state = arm.states[-1]
        for part in ("positions", "velocities"):
            for wanted, found, off in zip(
                getattr(state.desired, part), getattr(state.actual, part), getattr(state.error, part),
                strict=True,
            ):  # fmt: skip
                self.assertAlmostEqual(off, wanted - found, places=12)

    def test_a_controller_that_does_not_run_takes_no_goal(self):
        arm = self.arm(start=False)
        with self.assertRaisesRegex(rospy.ServiceException, "not running"):
            call("/slides/effort_arm/query_state", QueryTrajectoryState, rospy.Time(0))
        plan = trajectory(EFFORT, (1.0, [0.0, 0.0]))
        self.check(arm.pursue(plan), "REJECTED", "INVALID_GOAL", "not running")

    # goals that something else comes between

    def test_cancel_holds_the_joints(self):
        arm = self.arm()
        gazebo("unpause_physics")
        pursuit = arm.pursue(trajectory(EFFORT, (1.0, [1.0, 1.0])))
        self.assertTrue(wait_until(lambda: joint("effort_a")[0] > 0.3))
        pursuit.cancel()
        self.check(pursuit, "PREEMPTED", "SUCCEEDED", "canceled by its client")
        self.assertTrue(arm.wait_state(lambda state: state.desired.velocities == (0.0, 0.0)))
        wanted = arm.states[-1].desired.positions
        self.assertLess(max(wanted), 0.9)
        self.assertTrue(arm.wait_state(lambda state: max(map(abs, state.error.positions)) < 1e-3))
        self.assertEqual(arm.states[-1].desired.positions, wanted)

    def test_a_command_preempts_and_bad_ones_do_not(self):
        arm = self.arm()
        gazebo("unpause_physics")
        pursuit = arm.pursue(trajectory(EFFORT, (3.0, [1.0, 1.0])))
        self.assertTrue(pursuit.wait_active())
        before = len(arm.states)
        arm.command.publish(trajectory(EFFORT, (0.1, [math.nan, 0.0])))
        self.assertTrue(wait_until(lambda: len(arm.states) > before + 10))
        self.assertFalse(pursuit.has_ended())
        arm.command.publish(trajectory(EFFORT, (0.3, [-0.2, 0.1])))
        self.check(pursuit, "PREEMPTED", "SUCCEEDED", "command topic")
        self.assertTrue(arm.wait_state(lambda state: state.desired.positions == (0.1, -0.2)))

    # pause, reset, unload

    def test_a_goal_sent_while_paused_begins_with_time(self):
        arm = self.arm()
        pursuit = arm.pursue(trajectory(EFFORT, (0.3, [0.1, 0.1])))
        self.assertTrue(pursuit.wait_active())
        heard = self.hear(STATUS, GoalStatusArray, connected=False)
        self.assertTrue(heard.wait_for(lambda got: len(got) > 3), "no status while paused")
        gazebo("unpause_physics")
        self.check(pursuit, "SUCCEEDED", "SUCCEEDED")

    def test_it_works_after_reset_simulation(self):
        arm = self.arm()
        gazebo("unpause_physics")
        self.check(arm.pursue(trajectory(EFFORT, (0.3, [0.5, 0.5]))), "SUCCEEDED", "SUCCEEDED")
        # A cancel request with a stamp, which after the reset lies in the future.
        later = rospy.Time.now() + rospy.Duration(100)
        cancel = arm.action.action_client.pub_cancel
        pursuit = arm.pursue(trajectory(EFFORT, (5.0, [1.0, 1.0])))
        self.assertTrue(pursuit.wait_active())
        gazebo("reset_simulation")
        self.check(pursuit, "PREEMPTED", "SUCCEEDED", "started over")
        cancel.publish(GoalID(stamp=later))
        arm.states.clear()
        self.assertTrue(wait_until(lambda: len(arm.states) > 5))
        self.assertLess(arm.states[-1].header.stamp.to_sec(), 5.0)
        self.assertEqual(arm.states[-1].desired.positions, (0.0, 0.0))
        self.check(arm.pursue(trajectory(EFFORT, (0.3, [0.2, 0.2]))), "SUCCEEDED", "SUCCEEDED")

    def test_many_goals_over_many_resets_leave_no_list_of_them(self):
        arm = self.arm()
        heard = self.hear(STATUS, GoalStatusArray, connected=False)
        plan = trajectory(["elbow"], (1.0, [0.0]))
        for _ in range(105):
            self.check(arm.pursue(plan), "REJECTED", "INVALID_JOINTS")
            gazebo("reset_simulation")
        self.assertTrue(heard.wait_for(lambda got: len(got[-1].status_list) <= 101))
        # Five seconds of wall time later nothing of them is told any more, though time stands still.
        self.assertTrue(heard.wait_for(lambda got: not got[-1].status_list))

    def test_unloading_with_a_goal_tells_its_end_and_takes_everything_away(self):
        for round_ in range(3):  # reload must work
            with self.subTest(round_):
                arm = self.arm()
                action = {f"/slides/effort_arm/follow_joint_trajectory/{name}" for name in ACTION}
                self.assertLessEqual(action, topics_below("/slides/effort_arm"))
                gazebo("unpause_physics")
                pursuit = arm.pursue(trajectory(EFFORT, (5.0, [1.0, 1.0])))
                self.assertTrue(pursuit.wait_active())
                self.assertTrue(self.manager.reload(True))
                self.check(pursuit, "PREEMPTED", "SUCCEEDED", "stopped")
                arm.close()
                self.assertTrue(wait_until(lambda: not topics_below("/slides/effort_arm")))
                self.assertNotIn("effort_arm", rosnode.get_node_info_description("/gazebo"))
                gazebo("pause_physics")

    def test_deleting_the_robot_ends_the_goal(self):
        arm = self.arm()
        gazebo("unpause_physics")
        pursuit = arm.pursue(trajectory(EFFORT, (5.0, [1.0, 1.0])))
        self.assertTrue(pursuit.wait_active())
        delete_model("slides")
        self.check(pursuit, "PREEMPTED", "SUCCEEDED", "stopped")
