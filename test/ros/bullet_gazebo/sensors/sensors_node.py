#!/usr/bin/env python3
"""Sensors over ROS: each kind's message, its times, resets, and equal bits (docs/contract/sensors.md)."""

import math
import unittest

import numpy as np
import rospy
import rostest
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from gazebo_msgs.msg import ContactsState, ModelState
from gazebo_msgs.srv import DeleteModel, SetModelState, SpawnModel, SpawnModelRequest
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3Stamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import (
    CameraInfo,
    CompressedImage,
    Image,
    Imu,
    LaserScan,
    NavSatFix,
    PointCloud,
    PointCloud2,
    Range,
)
from std_msgs.msg import Empty as EmptyMsg
from std_srvs.srv import Empty
from support.ros.calls import call, wait_until
from support.ros.subscribed import Listener

SHAPE = "<geometry><box><size>1 1 1</size></box></geometry>"
RED = "<material><ambient>1 0 0 1</ambient><diffuse>1 0 0 1</diffuse></material>"
WALL = (
    f'<sdf version="1.6"><model name="w"><static>1</static><link name="l"><collision name="c">{SHAPE}'
    f'<laser_retro>5</laser_retro></collision><visual name="v">{SHAPE}{RED}</visual></link></model></sdf>'
)
MS = 1_000_000


class Heard(Listener):
    """The messages of a topic."""

    def after(self, count):
        """Returns the messages when there are as many."""
        assert self.wait_for(lambda messages: len(messages) >= count), self.messages
        return self.messages

    def stamps(self, count):
        return [message.header.stamp.to_nsec() for message in self.after(count)]

    def from_time(self, time):
        """Returns the newest message when one isn't older than `time` [ns]."""
        assert self.wait_for(lambda messages: messages[-1].header.stamp.to_nsec() >= time), time
        return self.messages[-1]


class Sensors(unittest.TestCase):
    def setUp(self):
        self.spawn("wall", WALL, x=2.0, z=0.5)
        self.spawn("bot", rospy.get_param("~model"))
        call("/gazebo/reset_simulation", Empty)

    def tearDown(self):
        for name in ("bot", "wall"):
            self.assertTrue(call("/gazebo/delete_model", DeleteModel, name).success)

    def spawn(self, name, xml, x=0.0, z=0.0):
        pose = Pose(Point(x, 0.0, z), Quaternion(0.0, 0.0, 0.0, 1.0))
        request = SpawnModelRequest(model_name=name, model_xml=xml, initial_pose=pose)
        request.robot_namespace = "/"
        self.assertTrue(call("/gazebo/spawn_sdf_model", SpawnModel, request).success)

    def hear(self, name, kind):
        heard = Heard(name, kind)
        self.addCleanup(heard.close)
        return heard

    def step(self, ticks, **more):
        answer = call("/gazebo/step_world", StepWorld, StepWorldRequest(ticks=ticks, **more))
        self.assertTrue(answer.success, answer.status_message)
        return round(1000 * answer.sim_time) * MS

    def newest(self, name, kind, ticks=300):
        heard = self.hear(name, kind)
        return heard.from_time(self.step(ticks) - 250 * MS)  # the slowest one has 4 Hz

    def test_a_scan_comes_every_hundred_ticks(self):
        heard = self.hear("/scan", LaserScan)
        self.step(250)
        self.step(50)
        # The first one is the newcomer's, as nothing was measured since the reset.
        self.assertEqual(heard.stamps(4), [0, 100 * MS, 200 * MS, 300 * MS])
        scan = heard.messages[-1]
        self.assertEqual(scan.header.frame_id, "base_scan")
        self.assertAlmostEqual(scan.ranges[0], 1.5, delta=0.05)
        self.assertEqual(list(scan.ranges[1:]), [math.inf] * 3)
        self.assertEqual(scan.intensities[0], 5.0)
        self.assertAlmostEqual(scan.angle_increment, math.pi / 2.0, places=6)
        self.assertEqual((scan.time_increment, scan.scan_time), (0.0, 0.0))

    def test_a_seed_draws_the_same_noise_again(self):
        runs = []
        for seed in (5, 6, 5):
            heard = self.hear("/scan", LaserScan)
            self.step(0, reset=StepWorldRequest.SIMULATION, seed=seed)
            self.step(300)
            heard.from_time(300 * MS)
            found = {
                message.header.stamp.to_nsec(): message.ranges[0] for message in heard.messages
            }
            runs.append([found[each * 100 * MS] for each in (1, 2, 3)])
            heard.close()
        self.assertEqual(len(set(runs[0])), 3)
        self.assertEqual(runs[0], runs[2])
        self.assertNotEqual(runs[0], runs[1])

    def test_resets_and_moves_bring_a_fresh_scan_at_once(self):
        heard = self.hear("/scan", LaserScan)
        self.step(150)
        heard.after(2)
        state = ModelState(model_name="bot", reference_frame="world")
        state.pose = Pose(Point(0.5, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        self.assertTrue(call("/gazebo/set_model_state", SetModelState, state).success)
        self.assertEqual(heard.stamps(3)[2], 150 * MS)
        self.assertAlmostEqual(heard.messages[2].ranges[0], 1.0, delta=0.05)
        call("/gazebo/reset_simulation", Empty)
        self.assertEqual(heard.stamps(4)[3], 0)
        self.assertAlmostEqual(heard.messages[3].ranges[0], 1.5, delta=0.05)
        self.step(100)
        self.assertEqual(heard.stamps(5)[4], 100 * MS)

    def test_clouds_and_ranges_of_a_laser(self):
        cloud = self.newest("/cloud", PointCloud2)
        self.assertEqual((cloud.width, cloud.height, cloud.point_step), (1, 1, 22))
        self.assertEqual([field.offset for field in cloud.fields], [0, 4, 8, 12, 16, 18])
        x, y, z, intensity = np.frombuffer(cloud.data[:16], "<f4")
        np.testing.assert_allclose((x, y, z, intensity), (1.5, 0.0, 0.0, 5.0), atol=0.05)
        block = self.newest("/block", PointCloud)
        self.assertEqual(len(block.points), 4)
        self.assertAlmostEqual(block.points[0].x, 1.5, delta=0.05)
        self.assertAlmostEqual(self.newest("/range", Range).range, 1.5, delta=0.05)

    def test_a_box_of_ten_kilograms_presses_on_its_bumper(self):
        state = self.newest("/bumper_states", ContactsState, 2000).states
        self.assertEqual(state[0].collision1_name, "bot::base::shell")
        self.assertIn("ground_plane", state[0].collision2_name)
        self.assertAlmostEqual(state[0].total_wrench.force.z, 98.0, delta=0.3)

    def test_one_imu_feels_gravity_and_the_older_one_does_not(self):
        heard = self.hear("/imu_data", Imu)
        sample = heard.from_time(self.step(1000) - 20 * MS)
        self.assertEqual(heard.stamps(1)[0], 40 * MS)  # the first one has none to compare with
        self.assertAlmostEqual(sample.linear_acceleration.z, 9.8, delta=0.01)
        self.assertEqual(sample.header.frame_id, "imu")
        older = self.newest("/old_imu", Imu).linear_acceleration
        self.assertAlmostEqual(older.z, 0.0, delta=0.01)

    def test_truth_is_the_links_pose(self):
        truth = self.newest("/truth", Odometry)
        self.assertEqual((truth.header.frame_id, truth.child_frame_id), ("world", "base"))
        self.assertAlmostEqual(truth.pose.pose.position.z, 0.05, delta=2e-3)

    def test_a_camera_sees_the_wall(self):
        image = self.newest("/eye/image_raw", Image)
        self.assertEqual((image.encoding, image.step), ("rgb8", 3 * 64))
        pixels = np.frombuffer(image.data, np.uint8).reshape(48, 64, 3)
        red, green, blue = pixels[24, 32]
        self.assertTrue(red > 50 and green == blue == 0)
        # The wall is 1 m wide, 1.5 m away: a third of a metre for each 18.5 pixels.
        columns = np.flatnonzero(pixels[24, :, 1] == 0)
        f = 64 / (2.0 * math.tan(1.047 / 2.0))
        self.assertAlmostEqual(columns[0], 32 - 0.5 * f / 1.5, delta=1.0)
        self.assertAlmostEqual(columns[-1] + 1, 32 + 0.5 * f / 1.5, delta=1.0)
        info = self.newest("/eye/camera_info", CameraInfo)
        self.assertAlmostEqual(info.K[0], f, places=12)
        self.assertEqual((info.K[2], info.header.frame_id), (32.5, "eye_optical"))
        jpeg = self.newest("/eye/image_raw/compressed", CompressedImage)
        self.assertEqual(jpeg.data[:2], b"\xff\xd8")

    def test_each_trigger_takes_one_picture(self):
        heard = self.hear("/shot/image_raw", Image)
        trigger = rospy.Publisher("/shot/image_trigger", EmptyMsg, queue_size=5)
        self.addCleanup(trigger.unregister)
        self.assertTrue(wait_until(trigger.get_num_connections))
        self.step(50)
        self.assertEqual(heard.messages, [])
        for triggers, count in ((1, 1), (2, 3)):
            for _ in range(triggers):
                trigger.publish()
            wait_until(lambda count=count: self.step(1) and len(heard.messages) >= count)
            self.assertEqual(len(heard.messages), count)

    def test_depths_of_both_depth_cameras(self):
        for name, organised in (("kinect", True), ("depth", False)):
            image = self.newest(f"/{name}/depth/image_raw", Image)
            self.assertEqual(image.encoding, "32FC1")
            depths = np.frombuffer(image.data, "<f4").reshape(48, 64)
            self.assertAlmostEqual(depths[24, 32], 1.5, delta=5e-3)
            sky = depths[0, 0]
            self.assertTrue(math.isnan(sky) if organised else sky == 100.0)
            cloud = self.newest(f"/{name}/points", PointCloud2)
            self.assertEqual((cloud.height, cloud.width), (48, 64) if organised else (1, 48 * 64))
            self.assertEqual(cloud.point_step, 32)

    def test_both_eyes_of_a_multicamera_look_at_one_time(self):
        left, right = (self.hear(f"/pair/{side}/image_raw", Image) for side in ("left", "right"))
        self.step(100)
        for heard in (left, right):  # the one that came first has one of time 0, too
            heard.from_time(100 * MS)
        edges = []
        for heard in (left, right):
            pixels = np.frombuffer(heard.messages[-1].data, np.uint8).reshape(48, 64, 3)
            edges.append(np.flatnonzero(pixels[24, :, 1] == 0)[0])
        f = 64 / (2.0 * math.tan(1.047 / 2.0))
        self.assertAlmostEqual(edges[0] - edges[1], 0.2 * f / 1.5, delta=1.0)
        info = self.newest("/pair/right/camera_info", CameraInfo)
        self.assertAlmostEqual(info.P[3], -0.2 * f, places=9)

    def test_hectors_sensors(self):
        self.assertAlmostEqual(self.newest("/hector", Imu).linear_acceleration.z, 9.8, delta=0.01)
        state = ModelState(model_name="bot", reference_frame="world")
        state.pose = Pose(Point(0.0, 0.5, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        self.assertTrue(call("/gazebo/set_model_state", SetModelState, state).success)
        fix = self.newest("/fix", NavSatFix)
        # x points east, so y points north.
        self.assertAlmostEqual((fix.latitude - 49.9) * 111_229.0, 0.5, delta=0.01)
        self.assertAlmostEqual((fix.longitude - 8.9) * 71_800.0, 0.0, delta=0.01)
        field = self.newest("/magnetic", Vector3Stamped).vector
        self.assertAlmostEqual(math.hypot(field.x, field.y, field.z), 1.0, places=6)
        self.assertAlmostEqual(field.z, -math.sin(math.radians(60.0)), delta=1e-3)

    def test_an_impossible_sensor_is_left_out_and_the_model_stands(self):
        topics = [name for name, _ in rospy.get_published_topics()]
        self.assertNotIn("/odd", topics)
        self.assertIn("/scan", topics)


if __name__ == "__main__":
    rospy.init_node("sensors_test")
    rostest.rosrun("cartpole", "sensors", Sensors)
