#!/usr/bin/env python3
"""The step service: exact ticks, repeatable bits, several clients; snapshots; and what a window is sent."""

import threading
from concurrent.futures import ThreadPoolExecutor

import rospy
import rostest
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest, StepWorldRequest
from lockstep_case import LockstepCase, step
from scene_cases import SceneTest
from snapshots_cases import SnapshotsTest
from support.ros.calls import BOUND, gazebo, sim_time

from ros_calls.service import ServiceClient

__all__ = ["LockstepTest", "SceneTest", "SnapshotsTest"]
CLIENTS, TIMES = 20, 25


class LockstepTest(LockstepCase):
    def test_time_moves_by_exactly_the_ticks_asked_for(self):
        for ticks, time in ((1, 0.001), (8, 0.009), (100, 0.109)):
            answer = step(ticks)
            self.assertAlmostEqual(answer.sim_time, time, places=9)
            self.assertAlmostEqual(answer.joint_states.header.stamp.to_sec(), time, places=9)
        self.assertAlmostEqual(sim_time(), 0.109, places=9)

    def test_unpause_does_not_start_time(self):
        gazebo("unpause_physics")
        threading.Event().wait(0.1)
        self.assertEqual(sim_time(), 0.0)

    def test_a_command_acts_from_the_first_tick_on(self):
        answer = step(1, 0.02)
        self.assertEqual(answer.joint_states.name, ["cart_pole", "stand_cart"])
        # The kick of docs/contract/ros_control.md 4, clipped.
        self.assertEqual(answer.joint_states.effort, (0.0, 30.0))

    def test_an_episode_begins_in_one_call(self):
        step(50, 0.3)
        place = {"joints": ["stand_cart", "cart_pole"], "positions": [0.1, -0.2]}
        answer = step(0, reset=StepWorldRequest.SIMULATION, **place, velocities=[0.5, 1.5])
        self.assertEqual(answer.sim_time, 0.0)
        self.assertEqual(answer.joint_states.position, (-0.2, 0.1))
        self.assertEqual(answer.joint_states.velocity, (1.5, 0.5))
        self.assertEqual(answer.joint_states.effort, (0.0, 0.0))
        # The controller holds where it was put, and knows no past: its first error is 0.
        self.assertEqual(step(1).joint_states.effort[1], 0.0)

    def test_a_long_step_lets_other_services_answer(self):
        worker = threading.Thread(target=step, args=(100_000,))
        worker.start()
        seen = set()
        while worker.is_alive():
            seen.add(sim_time())
        self.assertGreater(len(seen), 3)
        self.assertAlmostEqual(sim_time(), 100.0, places=6)

    def test_clients_come_ask_and_go_while_others_let_time_pass(self):
        def work(thread):
            for number in range(TIMES):
                advance = ServiceClient("/gazebo/advance_world", AdvanceWorld, timeout=BOUND)
                node = f"/crowd_{thread}_{number}"
                topics = ["/clock", "/gazebo/model_states"]
                answer = advance(AdvanceWorldRequest(node=node, ticks=2, until=topics))
                self.assertTrue(answer.success and answer.ticks == 2, answer)

        with ThreadPoolExecutor(CLIENTS) as pool:
            list(pool.map(work, range(CLIENTS)))
        self.assertAlmostEqual(sim_time(), 0.002 * CLIENTS * TIMES, places=9)


if __name__ == "__main__":
    rospy.init_node("lockstep_test")
    rostest.rosrun("cartpole", "lockstep", "__main__")
