"""Gains at run time: dynamic_reconfigure, write-back, PID state (docs/contract/ros_control.md 4)."""

import math
import subprocess

import rospy
from control_msgs.msg import JointControllerState, PidState
from dynamic_reconfigure.msg import Config, ConfigDescription, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest
from gazebo_msgs.srv import SetLinkPropertiesRequest
from rosgraph_msgs.msg import Log
from slides_client import SlidesTest
from support.ros.calls import call, gazebo

PID = "/slides/effort_position/pid"
NAMES = ["p", "i", "d", "i_clamp_min", "i_clamp_max", "antiwindup"]


def reconfigure(namespace, **doubles):
    request = ReconfigureRequest()
    request.config.doubles = [DoubleParameter(name, value) for name, value in doubles.items()]
    answer = call(f"{namespace}/set_parameters", Reconfigure, request).config
    return {each.name: each.value for each in [*answer.doubles, *answer.bools]}


class GainsTest(SlidesTest):
    def setUp(self):
        super().setUp()
        rospy.set_param(PID, {"p": 400.0, "d": 40.0, "publish_state": True})

    def test_dynparam_of_the_command_line(self):
        self.run_controllers("effort_position")
        state = self.hear("/slides/effort_position/state", JointControllerState)
        command = ["rosrun", "dynamic_reconfigure", "dynparam", "set", PID, "p", "250.0"]
        subprocess.run(command, check=True, timeout=60)
        self.step(1)
        self.assertTrue(state.wait_for(lambda got: got and got[-1].p == 250.0))
        self.assertEqual(rospy.get_param(f"{PID}/p"), 250.0)

    def test_gains_take_effect_are_clamped_and_told(self):
        self.run_controllers("effort_position")
        updates = self.hear("/slides/effort_position/pid/parameter_updates", Config)  # latched
        self.assertTrue(updates.wait_for(len))
        answer = reconfigure(PID, p=1e9, d=-1e9, i_clamp_max=-3.0, i_clamp_min=2.0, i=5.0)
        clamps = {"i_clamp_max": 0.0, "i_clamp_min": 0.0, "antiwindup": False}
        self.assertEqual(answer, {"p": 1e5, "d": -1e3, "i": 5.0} | clamps)
        self.assertTrue(updates.wait_for(lambda got: len(got) == 2))
        reconfigure(PID, p=100.0, i=0.0, d=0.0)
        joints = self.step(1, effort_position=0.1)
        self.assertAlmostEqual(joints["effort_a"][2], 10.0, places=9)

    def test_gains_that_the_step_cannot_follow_are_told_in_the_log(self):
        self.run_controllers("effort_position")
        light = SetLinkPropertiesRequest(link_name="slides::effort_a_carriage", mass=0.1)
        light.ixx = light.iyy = light.izz = 0.01
        self.assertTrue(gazebo("set_link_properties", light).success)
        log = self.hear("/rosout", Log)
        reconfigure(PID, p=400.0, d=800.0)
        wanted = "controller 'effort_position' drives joint 'effort_a' of model 'slides' with d = 800"
        self.assertTrue(log.wait_for(lambda got: any(wanted in each.msg for each in got)))
        [told] = [each for each in log.messages if wanted in each.msg]
        self.assertEqual(told.level, Log.WARN)
        self.assertIn("(about 200)", told.msg)

    def test_gains_that_are_no_numbers_are_refused(self):
        self.run_controllers("effort_position")
        for bad in (math.nan, math.inf):
            answer = reconfigure(PID, p=bad)
            self.assertTrue(math.isfinite(answer["p"]))
        self.assertTrue(math.isfinite(self.step(10, effort_position=0.1)["effort_a"][0]))

    def test_from_load_on_the_gains_are_on_the_parameter_server_and_described(self):
        self.assertTrue(self.manager.load("effort_position"))
        self.assertLessEqual(set(NAMES), set(rospy.get_param(PID)))
        self.assertEqual(rospy.get_param(f"{PID}/i_clamp_max"), 0.0)
        topic = self.hear("/slides/effort_position/pid/parameter_descriptions", ConfigDescription)
        self.assertTrue(topic.wait_for(len))
        description = topic.messages[0]
        self.assertEqual([p.name for p in description.groups[0].parameters], NAMES)
        self.assertEqual({p.name: p.value for p in description.max.doubles}["d"], 1000.0)

    def test_pid_state_is_published_on_each_computation_if_wanted(self):
        self.run_controllers("effort_position")
        topic = self.hear("/slides/effort_position/pid/state", PidState)
        self.step(1, effort_position=0.1)
        self.assertTrue(topic.wait_for(len))
        message = topic.messages[0]
        self.assertAlmostEqual(message.error, 0.1, places=12)
        self.assertAlmostEqual(message.p_term, 40.0, places=9)
        self.assertAlmostEqual(message.output, 40.0 + 40.0 * 0.1 / 0.001, places=6)
        self.assertEqual(message.timestep, rospy.Duration(0, 1_000_000))

    def test_every_joint_of_a_group_and_every_drive_has_gains(self):
        self.run_controllers("effort_group_position")
        for gains in ("effort_group_position/effort_b/pid", "gazebo_ros_control/pid_gains/velocity_b"):
            self.assertEqual(reconfigure(f"/slides/{gains}", p=111.0)["p"], 111.0)

    def test_they_go_with_the_controller(self):
        service = f"{PID}/set_parameters"
        for _ in range(2):
            self.assertTrue(self.manager.load("effort_position"))
            rospy.wait_for_service(service, 60.0)
            kept = rospy.ServiceProxy(service, Reconfigure, persistent=True)
            kept(ReconfigureRequest())
            self.assertTrue(self.manager.unload("effort_position"))
            with self.assertRaisesRegex(rospy.ServiceException, "the parameters are gone"):
                kept(ReconfigureRequest())
            kept.close()
            with self.assertRaises(rospy.ROSException):
                rospy.wait_for_service(service, 0.3)
