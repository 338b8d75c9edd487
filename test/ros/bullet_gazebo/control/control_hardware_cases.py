"""Limits, control periods and faulty controllers of users (docs/contract/ros_control.md 5)."""

import math

import rosgraph
import rospy
from control_msgs.msg import JointControllerState, PidState
from sensor_msgs.msg import JointState
from slides_client import SlidesTest
from std_msgs.msg import Float64
from support.ros.calls import delete_model, gazebo

DESCRIPTION, LIMITS = "/slides/robot_description", "/slides/joint_limits"


class HardwareTest(SlidesTest):
    """Each test changes the robot, and spawns it then."""

    def setUp(self):
        self.plain = rospy.get_param(DESCRIPTION)

    def tearDown(self):
        rospy.set_param(DESCRIPTION, self.plain)
        if rospy.has_param(LIMITS):
            rospy.delete_param(LIMITS)

    def begin(self, old="", new=""):
        self.assertIn(old, self.plain)
        rospy.set_param(DESCRIPTION, self.plain.replace(old, new) if old else self.plain)
        super().setUp()

    def test_limits_of_the_parameter_server_go_before_the_descriptions(self):
        effort = {"has_effort_limits": True, "max_effort": 3.0}
        slow = {"has_velocity_limits": True, "max_velocity": 0.2}
        rospy.set_param(LIMITS, {"effort_a": effort, "position_a": slow, "velocity_a": slow})
        self.begin()
        self.run_controllers("effort_joint", "position_joint", "velocity_joint")
        joints = self.step(100, effort_joint=9.0, position_joint=1.0, velocity_joint=1.0)
        self.assertEqual(joints["effort_a"][2], 3.0)
        self.assertAlmostEqual(joints["position_a"][0], 0.02, places=5)
        self.assertAlmostEqual(joints["velocity_a"][1], 0.2, places=5)

    def test_the_control_period_is_a_whole_number_of_steps(self):
        self.begin("<eStopTopic>", "<controlPeriod>0.0025</controlPeriod><eStopTopic>")
        self.run_controllers("effort_position")
        topic = self.hear("/slides/effort_position/state", JointControllerState)
        self.step(1)
        self.assertTrue(topic.wait_for(len))
        self.step(30)
        self.assertTrue(topic.wait_for(lambda got: len(got) == 2))
        first, second = topic.messages
        self.assertEqual((first.time_step, second.time_step), (0.003, 0.003))
        self.assertEqual((second.header.stamp - first.header.stamp).to_nsec(), 30_000_000)

    def test_a_reset_begins_a_control_period(self):
        self.begin("<eStopTopic>", "<controlPeriod>0.1</controlPeriod><eStopTopic>")
        pid = {"p": 400.0, "d": 40.0, "publish_state": True}
        rospy.set_param("/slides/effort_position/pid", pid)
        self.run_controllers("effort_position")
        self.step(150)
        for reset in ("reset_world", "reset_simulation"):
            topic = self.hear("/slides/effort_position/pid/state", PidState)
            gazebo(reset)
            self.step(1)
            self.assertTrue(topic.wait_for(len))
            self.assertEqual(topic.messages[0].timestep, rospy.Duration(0, 100_000_000))

    def test_each_field_of_a_controllers_state(self):
        self.begin()
        pid = {"p": 20.0, "i": 2.0, "d": 0.25, "i_clamp_min": -2.0, "i_clamp_max": 3.0}
        pid["antiwindup"] = True
        for name, joint, due in (
            ("effort_position", "effort_a", 21_000_000),
            ("velocity_position", "velocity_a", 51_000_000),
        ):
            rospy.set_param(f"/slides/{name}/pid", pid)
            self.run_controllers(name)
            topic = self.hear(f"/slides/{name}/state", JointControllerState)
            before = self.step(20, **{name: 0.1})[joint]
            self.step(1)
            due_now = topic.wait_for(lambda got, due=due: got[-1].header.stamp.nsecs == due)
            self.assertTrue(due_now)
            state = topic.messages[-1]
            self.assertEqual((state.process_value, state.process_value_dot), before[:2])
            self.assertEqual((state.set_point, state.error), (0.1, 0.1 - before[0]))
            gains = (state.p, state.i, state.d, state.i_clamp, state.antiwindup)
            self.assertEqual(gains, (20.0, 2.0, 0.25, 3.0, True))
            wanted = 20.0 * state.error - 0.25 * before[1]
            self.assertAlmostEqual(state.command, wanted, delta=0.1)  # and a little of the integral
            self.step(9)

    def test_a_robot_that_comes_late_has_its_joint_states_at_their_rate(self):
        self.begin()
        self.step(2000)
        delete_model("slides")
        self.spawn_robot()
        topic = self.start_states()
        for _ in range(35):
            self.step(1)
        self.assertTrue(topic.wait_for(lambda got: got and got[-1].header.stamp.to_nsec() >= 2_031_000_000))
        stamps = [message.header.stamp.to_nsec() // 1_000_000 for message in topic.messages]
        self.assertLessEqual(set(stamps), {2001, 2011, 2021, 2031})

    def start_states(self):
        self.assertTrue(self.manager.load("states"))
        topic = self.hear("/slides/joint_states", JointState)
        self.assertTrue(self.manager.switch(["states"]))
        return topic

    # controllers of users

    def load_rude(self, where):
        rospy.set_param("/slides/rude", {"type": "my_controllers/Rude", "joint": "effort_b", "where": where})
        return self.manager.load("rude")

    def test_a_controller_that_is_made_wrongly_is_refused_and_leaves_nothing(self):
        self.begin()
        for where in ("create", "nothing", "claimed", "topic"):
            self.assertFalse(self.load_rude(where), where)
            self.assertEqual(self.manager.listed(), [])
            topics = rosgraph.Master("/test").getPublishedTopics("/slides/rude")
            self.assertEqual(topics, [], where)

    def test_a_controller_that_ends_its_thread_or_reports_nonsense_is_stopped(self):
        self.begin()
        self.run_controllers("effort_position")
        for where in ("update", "report"):
            self.assertTrue(self.load_rude(where))
            self.hear("/slides/rude/report", rospy.AnyMsg)
            self.assertTrue(self.manager.switch(["rude"]))
            joints = self.step(500, effort_position=0.1)
            states = (self.state("rude"), self.state("effort_position"))
            self.assertEqual(states, ("stopped", "running"))
            self.assertAlmostEqual(joints["effort_a"][0], 0.1, delta=0.01)
            self.assertTrue(self.manager.unload("rude"))

    def test_a_message_that_cannot_be_sent_silences_nobody(self):
        self.begin()
        self.assertTrue(self.load_rude("content"))
        self.hear("/slides/rude/report", rospy.AnyMsg)
        self.assertTrue(self.manager.switch(["rude"]))
        states = self.start_states()
        self.step(200)
        self.assertEqual(self.state("rude"), "running")
        seen = len(states.messages)
        self.step(200)
        self.assertTrue(states.wait_for(lambda got: len(got) > seen))

    def test_a_reader_that_raises_loses_its_message_and_goes_on(self):
        self.begin()
        self.assertTrue(self.load_rude("command"))
        self.assertTrue(self.manager.switch(["rude"]))
        command = self.publisher("/slides/rude/command", Float64)
        self.publish_until(command, 1.0, lambda joints: joints["effort_b"][2] == 1.0)
        command.publish(-1.0)
        command.publish(math.nan)
        answer = gazebo("step_world", ticks=1, controllers=["rude"], commands=[-1.0])
        self.assertFalse(answer.success)
        self.assertIn("the reader of 'command' raised SystemExit", answer.status_message)
        self.publish_until(command, 2.0, lambda joints: joints["effort_b"][2] == 2.0)
        self.assertEqual(self.state("rude"), "running")
