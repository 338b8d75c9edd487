"""Many clients of a world in lock-step that come, ask and go at once."""

import unittest
from concurrent.futures import ThreadPoolExecutor

from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest
from gazebo_msgs.srv import GetWorldProperties
from std_srvs.srv import Empty
from support.ros.calls import BOUND

from ros_calls.service import ServiceClient
from ros_calls.waiting import wait_and_call

CLIENTS, TIMES = 20, 25


class CrowdTest(unittest.TestCase):
    def test_clients_come_ask_and_go_while_others_let_time_pass(self):
        wait_and_call("/gazebo/reset_simulation", Empty)

        def work(thread):
            for number in range(TIMES):
                advance = ServiceClient("/gazebo/advance_world", AdvanceWorld, timeout=BOUND)
                node = f"/crowd_{thread}_{number}"
                topics = ["/clock", "/gazebo/model_states"]
                answer = advance(AdvanceWorldRequest(node=node, ticks=2, until=topics))
                self.assertTrue(answer.success and answer.ticks == 2, answer)

        with ThreadPoolExecutor(CLIENTS) as pool:
            list(pool.map(work, range(CLIENTS)))
        world = wait_and_call("/gazebo/get_world_properties", GetWorldProperties)
        self.assertAlmostEqual(world.sim_time, 0.002 * CLIENTS * TIMES, places=9)
