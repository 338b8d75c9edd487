"""save_state and restore_state, case by case, in a world in lock-step with the cart-pole in it."""

from pathlib import Path

import rospkg
from lockstep_case import LockstepCase, step
from rosgraph_msgs.msg import Clock
from support.ros.calls import gazebo

from ros_utils.step_client import PreparedSteps, StepNames

MOST = 1000  # states
MS = 1_000_000  # [ns]
BOT = Path(rospkg.RosPack().get_path("cartpole"), "test/data/sensors/bot.sdf")


def save(name, forget=()):
    return gazebo("save_state", name=name, forget=list(forget))


def restore(name):
    return gazebo("restore_state", name=name)


def told(ticks, command=None):
    """What a step tells of time and joints."""
    answer = step(ticks, command)
    joints = answer.joint_states
    return answer.sim_time, joints.position, joints.velocity, joints.effort


def future():
    return [told(3, 0.05 * (index % 5)) for index in range(30)]


class SnapshotsTest(LockstepCase):
    def setUp(self):
        super().setUp()
        step(50, 0.2)

    def test_the_same_commands_lead_to_the_same_bits(self):
        self.assertTrue(save("here").success)
        first = future()
        self.assertTrue(restore("here").success)
        self.assertEqual(future(), first)
        gazebo("reset_world")
        step(7, -0.3)
        self.assertTrue(restore("here").success)
        self.assertEqual(future(), first)

    def test_states_go_and_come_as_bytes(self):
        self.assertTrue(save("here").success)
        first = future()
        read = gazebo("save_state", read="here")
        self.assertTrue(read.success and len(read.data) < 12_000)
        save("", ["here"])
        gazebo("reset_world")
        answer = gazebo("restore_state", data=read.data, name="back")
        self.assertTrue(answer.success, answer.status_message)
        self.assertEqual(future(), first)
        self.assertTrue(restore("back").success)
        self.assertEqual(future(), first)
        save("", ["back"])

    def test_bytes_that_are_no_state_are_refused_and_change_nothing(self):
        self.assertTrue(save("here").success)
        data = gazebo("save_state", read="here").data
        first = future()
        restore("here")
        for wrong in (b"x", data[:-1], data[:60] + bytes([data[60] ^ 1]) + data[61:], data + b"x"):
            answer = gazebo("restore_state", data=wrong)
            self.assertFalse(answer.success)
            self.assertNotIn("\n", answer.status_message)
        self.assertEqual(future(), first)
        self.assertIn("no state 'her'", gazebo("save_state", read="her").status_message)
        save("", ["here"])

    def test_a_name_stands_for_its_newest_state(self):
        save("there")
        step(10, 0.3)
        save("there")
        later = future()
        restore("there")
        self.assertEqual(future(), later)

    def test_time_goes_back_and_the_clock_says_so(self):
        clock = self.hear("/clock", Clock)
        save("early")
        step(100)
        self.assertTrue(clock.wait_for(lambda each: each[-1].clock.to_nsec() == 150 * MS))
        restore("early")
        self.assertTrue(clock.wait_for(lambda each: each[-1].clock.to_nsec() == 50 * MS))

    def test_an_unknown_name_is_refused_and_nothing_moves(self):
        before = step(1).sim_time
        answer = restore("nowhere")
        self.assertFalse(answer.success)
        self.assertIn("nowhere", answer.status_message)
        self.assertAlmostEqual(step(1).sim_time, before + 0.001, places=9)

    def test_a_state_of_another_world_is_refused(self):
        save("alone")
        ball = (
            '<robot name="ball"><link name="l"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" '
            'ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
        )
        self.spawn("ball", ball, y=3.0)
        answer = restore("alone")
        self.assertFalse(answer.success)
        self.assertIn("models", answer.status_message)

    def test_sensors_of_prepared_steps_measure_at_the_same_times(self):
        """Also those that another client's steps have ended or replaced, and none that have begun since."""
        self.spawn("bot", BOT.read_text(), kind="sdf", y=3.0)
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
            data = gazebo("save_state", read="measuring").data
            for others in (None, (), ("inertia",), ("inertia", "scanner")):
                if others is not None:
                    steps.begin(StepNames(sensors=others), 5, [])
                    steps.end()
                for how in ({"name": "measuring"}, {"data": data}):
                    answer = gazebo("restore_state", **how)
                    self.assertTrue(answer.success, answer.status_message)
                    self.assertEqual(measured(), first)

    def test_states_are_bounded_and_can_be_forgotten(self):
        names = [f"state_{number}" for number in range(MOST)]
        for name in (*names, "state_0"):  # a new one in the place of the old one
            self.assertTrue(save(name).success)
        data = gazebo("save_state", read="state_1").data
        self.assertTrue(gazebo("restore_state", data=data, name="one more").success)
        self.assertIn("discarded as the oldest of 1000", restore("state_1").status_message)
        self.assertTrue(restore("state_0").success)
        self.assertTrue(save("one more", forget=[*names, "never saved"]).success)
        self.assertFalse(restore("state_2").success)
        self.assertTrue(restore("one more").success)

    def test_long_names_are_refused_and_cut(self):
        for answer in (save("x" * 201), restore("x" * 201)):
            self.assertIn("a state's name has at most 200 characters, not 201", answer.status_message)
