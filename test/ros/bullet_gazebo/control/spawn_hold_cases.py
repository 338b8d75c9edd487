"""A spawned model takes no step before its drives exist, however slowly its plugins load."""

import threading
from concurrent.futures import ThreadPoolExecutor

import rospy
from std_srvs.srv import Empty, EmptyResponse
from support.ros.calls import BOUND, gazebo, joint, sim_time, wait_until
from support.ros.world_case import WorldCase

CALLS = 100  # while plugins load; each takes as long as several ticks
FALL = 0.5  # [s of simulated time]


class SpawnHoldTest(WorldCase):
    def setUp(self):
        self.loading, self.go_on = threading.Event(), threading.Event()
        self.addCleanup(rospy.Service("/loading", Empty, self.load).shutdown)
        self.addCleanup(self.go_on.set)
        gazebo("unpause_physics")

    def load(self, request):
        self.loading.set()
        self.assertTrue(self.go_on.wait(BOUND))
        return EmptyResponse()

    def pass_time(self, seconds):
        end = sim_time() + seconds
        self.assertTrue(wait_until(lambda: sim_time() >= end), "time doesn't pass")

    def test_joints_hold_the_pose_that_they_were_spawned_at(self):
        self.pass_time(0.1)  # it runs
        xml = rospy.get_param("/lifts/robot_description")
        with ThreadPoolExecutor(1) as pool:
            spawned = pool.submit(self.spawn, "lifts", xml, "/lifts")
            self.assertTrue(self.loading.wait(BOUND))
            held = {sim_time() for _ in range(CALLS)}
            self.assertEqual(len(held), 1, "time passes while plugins load")
            places = [joint(each)[0] for each in ("held", "braked", "free")]
            self.assertEqual(places, [0.0, 0.0, 0.0])
            # It is not paused for that; who pauses and unpauses doesn't let it run.
            self.assertFalse(gazebo("get_physics_properties").pause)
            gazebo("pause_physics")
            gazebo("unpause_physics")
            self.assertEqual(sim_time(), held.pop())
            self.go_on.set()
            spawned.result(BOUND)
        self.pass_time(FALL)
        # No controller has come yet: that isn't needed.
        self.assertAlmostEqual(joint("held")[0], 0.0, places=4)
        self.assertAlmostEqual(joint("braked")[0], 0.0, places=2)
        self.assertLess(joint("free")[0], -0.9 * 4.9 * FALL**2)
