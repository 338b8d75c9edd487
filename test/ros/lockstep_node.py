#!/usr/bin/env python3
"""The step service over real ROS: exact ticks, repeatable bits, and what it refuses."""

import threading
import unittest

import rospy
import rostest
from controller_manager_msgs.srv import LoadController, SwitchController
from gazebo_msgs.srv import GetWorldProperties, SpawnModel, SpawnModelRequest
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty

from cartpole.srv import StepWorld

BOUND = 20.0  # [s of wall time]
STATES, CART = "joint_state_controller", "stand_cart_position_controller"


def proxy(name, kind):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind, persistent=True)


class LockstepTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        xml = rospy.get_param("/robot_description")
        request = SpawnModelRequest(model_name="cartpole", model_xml=xml, robot_namespace="/")
        assert proxy("/gazebo/spawn_urdf_model", SpawnModel)(request).success
        for name in (STATES, CART):
            assert proxy("/controller_manager/load_controller", LoadController)(name).ok
        assert proxy("/controller_manager/switch_controller", SwitchController)(
            [STATES, CART], [], 2, False, 0.0
        ).ok
        cls.step = staticmethod(proxy("/gazebo/step_world", StepWorld))
        cls.reset = staticmethod(proxy("/gazebo/reset_simulation", Empty))
        cls.world = staticmethod(proxy("/gazebo/get_world_properties", GetWorldProperties))

    def setUp(self):
        self.reset()

    def test_time_moves_by_exactly_the_ticks_asked_for(self):
        for ticks, time in ((1, 0.001), (8, 0.009), (100, 0.109)):
            answer = self.step(ticks, [], [])
            self.assertTrue(answer.success, answer.status_message)
            self.assertAlmostEqual(answer.sim_time, time, places=9)
            self.assertAlmostEqual(answer.joint_states.header.stamp.to_sec(), time, places=9)
        self.assertAlmostEqual(self.world().sim_time, 0.109, places=9)

    def test_unpause_does_not_start_time(self):
        proxy("/gazebo/unpause_physics", Empty)()
        threading.Event().wait(0.1)
        self.assertEqual(self.world().sim_time, 0.0)

    def test_a_command_acts_from_the_first_tick_on(self):
        answer = self.step(1, [CART], [0.02])
        self.assertEqual(answer.joint_states.name, ["cart_pole", "stand_cart"])
        self.assertEqual(answer.joint_states.effort, (0.0, 30.0))  # the kick of section 4, clipped

    def test_the_same_commands_give_the_same_bits(self):
        runs = []
        for _ in range(2):
            self.reset()
            run = []
            for index in range(200):
                state = self.step(8, [CART], [0.02 * (index % 5)]).joint_states
                run.append((state.position, state.velocity, state.effort))
            runs.append(run)
        self.assertEqual(runs[0], runs[1])

    def test_what_is_refused_leaves_the_world_as_it_was(self):
        for args, text in (
            ((0, [], []), "ticks is 0"),
            ((1, ["nobody"], [0.1]), "no controller named 'nobody'"),
            ((1, [CART, "nobody"], [0.1, 0.1]), "no controller named 'nobody'"),
            ((1, [CART], []), "1 controllers but 0 commands"),
            ((1, [CART], [float("nan")]), "not finite"),
            ((1, [CART], [float("inf")]), "not finite"),
            ((1, [STATES], [0.1]), "takes no single command"),
        ):
            with self.subTest(text):
                answer = self.step(*args)
                self.assertFalse(answer.success)
                self.assertIn(text, answer.status_message)
                self.assertEqual(answer.sim_time, 0.0)
        self.assertEqual(self.step(1, [], []).joint_states.effort, (0.0, 0.0))

    def test_two_clients_at_once_each_get_their_ticks(self):
        def work():
            step = proxy("/gazebo/step_world", StepWorld)
            for _ in range(50):
                step(2, [], [])

        threads = [threading.Thread(target=work) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(BOUND)
        self.assertAlmostEqual(self.world().sim_time, 0.2, places=9)

    def test_a_long_step_lets_other_services_answer(self):
        step = proxy("/gazebo/step_world", StepWorld)
        worker = threading.Thread(target=step, args=(100_000, [], []))
        worker.start()
        seen = set()
        while worker.is_alive():
            seen.add(self.world().sim_time)
        self.assertGreater(len(seen), 3)
        self.assertAlmostEqual(self.world().sim_time, 100.0, places=6)

    def test_the_last_clock_always_arrives(self):
        seen, arrived = [], threading.Event()

        def receive(message):
            seen.append(message.clock.to_nsec())
            if seen[-1] == 1_000_000_000:
                arrived.set()

        subscriber = rospy.Subscriber("/clock", Clock, receive)
        for _ in range(int(BOUND / 0.01)):
            if subscriber.get_num_connections():
                break
            threading.Event().wait(0.01)
        self.step(1000, [], [])
        self.assertTrue(arrived.wait(BOUND))
        subscriber.unregister()


if __name__ == "__main__":
    rospy.init_node("lockstep_test")
    rostest.rosrun("cartpole", "lockstep", LockstepTest)
