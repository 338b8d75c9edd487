#!/usr/bin/env python3
"""Sensors over ROS: each kind's message, its times, resets, and equal bits (docs/contract/sensors.md)."""

import math
import sys

import numpy as np
import rospy
import rostest
from contract_cases import Contract, Felt
from dynamic_reconfigure.client import Client as DynamicClient
from geometry_msgs.msg import Vector3, Vector3Stamped
from hector_gazebo_plugins.srv import SetBias
from sensor_case import MS, SensorCase
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

__all__ = ["Contract", "Felt", "Sensors"]


class Sensors(SensorCase):
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
        trigger = self.publisher("/shot/image_trigger", EmptyMsg)
        self.step(50)
        self.assertEqual(heard.messages, [])
        for triggers, count in ((1, 1), (2, 3)):
            for _ in range(triggers):
                trigger.publish()
            wait_until(lambda count=count: self.step(1) and len(heard.messages) >= count)
            self.assertEqual(len(heard.messages), count)
        self.hear("/shot/image_raw", Image).after(1)  # the last one, for who comes later

    def test_a_new_subscriber_gets_no_old_picture(self):
        first = self.hear("/eye/image_raw", Image)
        self.assertTrue(wait_until(lambda: self.step(10) and first.messages))
        first.close()
        time = self.step(2000)
        later = self.hear("/eye/image_raw", Image)
        self.assertTrue(wait_until(lambda: self.step(1) and later.messages))
        self.assertGreaterEqual(later.stamps(1)[0], time)

    def test_depths_of_both_depth_cameras(self):
        for name, organised in (("kinect", True), ("depth", False)):
            # A wall that is too near, and one at a metre.
            for x, expected in ((1.2, math.nan), (0.5, 1.0)):
                self.put(x=x)
                image = self.newest(f"/{name}/depth/image_raw", Image)
                depths = np.frombuffer(image.data, "<f4").reshape(48, 64)
                np.testing.assert_allclose(depths[24, 32], expected, atol=5e-3)
            self.assertEqual(image.encoding, "32FC1")
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

    def test_a_sonar_hears_the_wall(self):
        heard = self.hear("/sonar", Range)
        echo = heard.from_time(self.step(300))
        self.assertAlmostEqual(echo.range, 1.5, delta=0.05)
        self.assertEqual((echo.radiation_type, echo.header.frame_id), (0, "/sonar_link"))
        self.assertTrue(all(stamp % (100 * MS) == 0 for stamp in heard.stamps(3)))

    def test_a_realsense_has_colours_depths_and_a_cloud(self):
        self.put(x=0.5)
        colour = self.newest("/d435/color/image_raw", Image)
        self.assertEqual((colour.encoding, colour.header.frame_id), ("rgb8", "d435_color"))
        self.assertEqual(self.newest("/d435/infra1/image_raw", Image).encoding, "mono8")
        depth = self.newest("/d435/depth/image_raw", Image)
        self.assertEqual(depth.encoding, "16UC1")
        depths = np.frombuffer(depth.data, "<u2").reshape(24, 32)
        self.assertEqual((depths[12, 16], depths[0, 0]), (1000, 0))
        info = self.newest("/d435/depth/camera_info", CameraInfo)
        self.assertEqual((info.K[2], info.K[5], info.P[2], info.P[6]), (16.0, 12.0, 16.0, 12.0))
        cloud = self.newest("/d435/depth/points", PointCloud2)
        self.assertEqual((cloud.height, cloud.width, cloud.point_step), (24, 32, 32))
        points = np.frombuffer(cloud.data, np.uint8).reshape(24, 32, 32)
        self.assertTrue(points[12, 16, 18] > 50 and points[12, 16, 16] == 0)  # red, not blue

    def test_a_cameras_rate_can_be_changed(self):
        config = DynamicClient("/eye", timeout=60.0)
        heard = self.hear("/eye/image_raw", Image)
        self.step(300)
        heard.from_time(300 * MS)
        config.update_configuration({"imager_rate": 20.0})
        self.addCleanup(config.update_configuration, {"imager_rate": 10.0})
        heard.from_time(self.step(100))
        stamps = sorted(set(heard.stamps(1)))
        self.assertEqual(stamps[1:], [each * MS for each in (100, 200, 300, 350, 400)])

    def test_hectors_imu_has_biases_and_an_error_model(self):
        before = self.newest("/hector", Imu).linear_acceleration.z
        self.assertAlmostEqual(before, 9.8, delta=0.01)
        call("/hector/set_accel_bias", SetBias, Vector3(0.0, 0.0, 0.5))
        call("/hector/set_rate_bias", SetBias, Vector3(0.25, 0.0, 0.0))
        biased = self.newest("/hector", Imu)
        self.assertAlmostEqual(biased.linear_acceleration.z - before, 0.5, delta=0.01)
        self.assertAlmostEqual(biased.angular_velocity.x, 0.25, delta=0.01)
        bias = self.newest("/hector/bias", Imu)
        self.assertAlmostEqual(bias.linear_acceleration.z, 0.5, delta=0.01)
        call("/hector/calibrate", Empty)
        self.assertAlmostEqual(self.newest("/hector", Imu).angular_velocity.x, 0.0, delta=0.01)
        config = DynamicClient("/hector/accel", timeout=60.0)
        self.assertEqual(config.get_configuration()["scale_error"], 1.0)
        config.update_configuration({"scale_error": 2.0})
        self.addCleanup(config.update_configuration, {"scale_error": 1.0})
        doubled = self.newest("/hector", Imu).linear_acceleration.z
        self.assertAlmostEqual(doubled, 2.0 * before + 0.5, delta=0.02)

    def test_hectors_sensors(self):
        self.put(y=0.5)
        fix = self.newest("/fix", NavSatFix)
        # x points east, so y points north.
        self.assertAlmostEqual((fix.latitude - 49.9) * 111_229.0, 0.5, delta=0.01)
        self.assertAlmostEqual((fix.longitude - 8.9) * 71_800.0, 0.0, delta=0.01)
        field = self.newest("/magnetic", Vector3Stamped).vector
        self.assertAlmostEqual(math.hypot(field.x, field.y, field.z), 1.0, places=6)
        self.assertAlmostEqual(field.z, -math.sin(math.radians(60.0)), delta=1e-3)


if __name__ == "__main__":
    rospy.init_node("sensors_test")
    rostest.rosrun("cartpole", "sensors", "__main__.Felt" if "felt" in sys.argv else "__main__")
