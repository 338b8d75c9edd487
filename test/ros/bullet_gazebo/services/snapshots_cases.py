"""save_state and restore_state, case by case, in a world in lock-step with the cart-pole in it."""

import unittest
from pathlib import Path

import rospkg
from bullet_gazebo_msgs.srv import RestoreState, SaveState, StepWorld, StepWorldRequest
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty
from support.ros.calls import call, delete_model, spawn_model
from support.ros.subscribed import Listener

from ros_utils import ros_gazebo
from ros_utils.step_client import PreparedSteps, StepNames

CART = "stand_cart_position_controller"
MOST = 1000  # states
MS = 1_000_000  # [ns]
BOT = str(Path(rospkg.RosPack().get_path("cartpole"), "test/data/sensors/bot.sdf"))


def save(name, forget=()):
    return call("/gazebo/save_state", SaveState, name=name, forget=list(forget))


def restore(name):
    return call("/gazebo/restore_state", RestoreState, name=name)


def step(ticks, command=None):
    request = StepWorldRequest(ticks=ticks)
    if command is not None:
        request.controllers, request.commands = [CART], [command]
    answer = call("/gazebo/step_world", StepWorld, request)
    joints = answer.joint_states
    return answer.sim_time, joints.position, joints.velocity, joints.effort


def future():
    return [step(3, 0.05 * (index % 5)) for index in range(30)]


class SnapshotsTest(unittest.TestCase):
    def setUp(self):
        call("/gazebo/reset_simulation", Empty)
        step(50, 0.2)

    def test_the_same_commands_lead_to_the_same_bits(self):
        self.assertTrue(save("here").success)
        first = future()
        self.assertTrue(restore("here").success)
        self.assertEqual(future(), first)
        call("/gazebo/reset_world", Empty)
        step(7, -0.3)
        self.assertTrue(restore("here").success)
        self.assertEqual(future(), first)

    def test_states_go_and_come_as_bytes(self):
        self.assertTrue(save("here").success)
        first = future()
        read = call("/gazebo/save_state", SaveState, read="here")
        self.assertTrue(read.success and len(read.data) < 12_000)
        save("", ["here"])
        call("/gazebo/reset_world", Empty)
        answer = call("/gazebo/restore_state", RestoreState, data=read.data, name="back")
        self.assertTrue(answer.success, answer.status_message)
        self.assertEqual(future(), first)
        self.assertTrue(restore("back").success)
        self.assertEqual(future(), first)
        save("", ["back"])

    def test_bytes_that_are_no_state_are_refused_and_change_nothing(self):
        self.assertTrue(save("here").success)
        data = call("/gazebo/save_state", SaveState, read="here").data
        first = future()
        restore("here")
        for wrong in (b"x", data[:-1], data[:60] + bytes([data[60] ^ 1]) + data[61:], data + b"x"):
            answer = call("/gazebo/restore_state", RestoreState, data=wrong)
            self.assertFalse(answer.success)
            self.assertNotIn("\n", answer.status_message)
        self.assertEqual(future(), first)
        self.assertIn(
            "no state 'her'", call("/gazebo/save_state", SaveState, read="her").status_message
        )
        save("", ["here"])

    def test_a_name_stands_for_its_newest_state(self):
        save("there")
        step(10, 0.3)
        save("there")
        later = future()
        restore("there")
        self.assertEqual(future(), later)

    def test_time_goes_back_and_the_clock_says_so(self):
        clock = Listener("/clock", Clock)
        self.addCleanup(clock.close)
        save("early")
        step(100)
        self.assertTrue(clock.wait_for(lambda each: each[-1].clock.to_nsec() == 150 * MS))
        restore("early")
        self.assertTrue(clock.wait_for(lambda each: each[-1].clock.to_nsec() == 50 * MS))

    def test_an_unknown_name_is_refused_and_nothing_moves(self):
        before = step(1)
        answer = restore("nowhere")
        self.assertFalse(answer.success)
        self.assertIn("nowhere", answer.status_message)
        self.assertAlmostEqual(step(1)[0], before[0] + 0.001, places=9)

    def test_a_state_of_another_world_is_refused(self):
        save("alone")
        ball = (
            '<robot name="ball"><link name="l"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" '
            'ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
        )
        self.assertTrue(spawn_model("ball", ball, y=3.0).success)
        answer = restore("alone")
        self.assertFalse(answer.success)
        self.assertIn("models", answer.status_message)
        delete_model("ball")

    def test_sensors_of_prepared_steps_measure_at_the_same_times(self):
        """Also those that another client's steps have ended since, and none that have begun since."""
        self.assertTrue(ros_gazebo.gazebo_spawn_sdf_path(BOT, "bot", pos_y=3.0))
        self.addCleanup(delete_model, "bot")
        steps, names = PreparedSteps(), StepNames(sensors=("scanner",))
        self.addCleanup(steps.close)

        def measured():
            seen = []
            for _ in range(30):
                steps.begin(names, 7, [])
                seen.append([(each.now, each.values) for each in steps.end().sensors])
            return seen

        for ends_before in (False, True):
            measured()
            if ends_before:
                step(5)
            save("measuring")
            first = measured()
            for ends in (False, True):
                if ends:
                    step(5)
                restore("measuring")
                self.assertEqual(measured(), first)

    def test_states_are_bounded_and_can_be_forgotten(self):
        kept = 0
        while save(f"state_{kept}").success:
            kept += 1
        self.assertLessEqual(kept, MOST)
        self.assertFalse(save("one more").success)
        data = call("/gazebo/save_state", SaveState, read="state_0").data
        before = step(1)[0]
        answer = call("/gazebo/restore_state", RestoreState, data=data, name="one more")
        self.assertFalse(answer.success)
        self.assertAlmostEqual(step(1)[0], before + 0.001, places=9)  # nothing has changed
        self.assertTrue(save("state_0").success)  # a new one in the place of the old one
        names = [f"state_{number}" for number in range(kept)]
        self.assertTrue(save("one more", forget=[*names, "never saved"]).success)
        self.assertFalse(restore("state_1").success)
        self.assertTrue(restore("one more").success)
