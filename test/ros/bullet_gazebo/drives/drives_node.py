#!/usr/bin/env python3
"""Vehicles over ROS: commands, odometry, tf, times and resets of plugins and controllers."""

import rospy
import rostest
from dynamic_reconfigure.client import Client as DynamicClient
from four_wheel_steering_msgs.msg import FourWheelSteering, FourWheelSteeringStamped
from geometry_msgs.msg import Twist, TwistStamped, Vector3, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from support.robots.vehicles import RADIUS, TRACK, four_wheels, two_wheels
from support.ros.calls import BOUND, gazebo, step_world, wait_until
from support.ros.manager import STRICT, Manager
from support.ros.world_case import WorldCase
from tf2_msgs.msg import TFMessage

MS = 1_000_000
LONGEST = 0.06  # [s] between two messages of an odometry
DIFF = {
    "libgazebo_ros_diff_drive.so": {
        "leftJoint": "left_joint", "rightJoint": "right_joint", "wheelSeparation": TRACK,
        "wheelDiameter": 2.0 * RADIUS, "publishWheelJointState": "true",
    }
}  # fmt: skip
CONTROL = {"libgazebo_ros_control.so": {}}
COVARIANCES = {
    f"{what}_covariance_diagonal": [0.001, 0.001, 0.001, 0.001, 0.001, 0.03] for what in ("pose", "twist")
}


class Drives(WorldCase):
    def begin(self, urdf):
        gazebo("reset_simulation")
        rospy.set_param("/robot_description", urdf)
        self.spawn("bot", urdf, z=RADIUS)

    def step(self, ticks):
        self.now = step_world(ticks).sim_time

    def stamps(self, heard, count):
        self.assertTrue(heard.wait_for(lambda messages: len(messages) >= count))
        return [message.header.stamp.to_nsec() // MS for message in heard.messages]

    def newest(self, heard):
        """Returns the message at, or just before, the end of the last step."""
        since = self.now - LONGEST
        self.assertTrue(heard.wait_for(lambda each: each[-1].header.stamp.to_sec() > since))
        return heard.messages[-1]

    def told_since(self, begin, heard, count):
        """Returns what the messages stamped after `begin` hold, but for their sequence numbers."""

        def since(messages):
            return [each for each in messages if each.header.stamp.to_sec() > begin]

        self.assertTrue(heard.wait_for(lambda messages: len(since(messages)) >= count))
        return [(m.header.stamp, repr(m.pose), repr(m.twist)) for m in since(heard.messages)]

    def state(self):
        return gazebo("get_model_state", "bot", "world")

    def follow(self, topic, message, odometry):
        """Publishes, and waits until the robot moves: what is underway when a step begins is late."""
        self.publisher(topic, type(message), latch=True).publish(message)

        def moves():
            self.step(20)
            return abs(self.newest(odometry).twist.twist.linear.x) > 1e-3

        self.assertTrue(wait_until(moves))

    def test_two_wheels_drive_by_their_plugin(self):
        self.begin(two_wheels(**DIFF))
        odometry, tf = self.hear("/odom", Odometry), self.hear("/tf", TFMessage)
        joints = self.hear("/joint_states", JointState)
        self.step(500)
        self.assertEqual(self.stamps(odometry, 49), list(range(11, 500, 10)))
        self.follow("/cmd_vel", Twist(linear=Vector3(x=0.2)), odometry)
        begin = self.state().pose.position.x
        for _ in range(10):  # a publisher's queue holds 100 messages
            self.step(500)
            self.newest(odometry)
            self.assertTrue(tf.wait_for(lambda messages: len(messages) >= len(odometry.messages)))
        way = self.state().pose.position.x - begin
        self.assertAlmostEqual(way, 1.0, delta=0.04)
        self.assertEqual(joints.messages[-1].name, ["right_joint", "left_joint"])
        for message, transforms in zip(odometry.messages, tf.messages, strict=False):
            (transform,) = transforms.transforms
            place, move = message.pose.pose.position, transform.transform.translation
            self.assertEqual((place.x, place.y, place.z), (move.x, move.y, move.z))
            self.assertEqual(message.header.stamp, transform.header.stamp)
        self.assertEqual(transform.child_frame_id, "base_footprint")

    def test_a_vehicle_and_its_odometry_go_on_from_a_snapshot(self):
        by_wheels = {"odometrySource": "encoder"} | DIFF["libgazebo_ros_diff_drive.so"]
        self.begin(two_wheels(**{"libgazebo_ros_diff_drive.so": by_wheels}))
        odometry = self.hear("/odom", Odometry)
        self.follow("/cmd_vel", Twist(Vector3(x=0.3), Vector3(z=0.5)), odometry)
        self.step(200)
        begin = self.now
        self.assertTrue(gazebo("save_state", name="driving").success)
        runs = []
        for _ in range(2):
            odometry.messages.clear()
            self.step(400)
            # The last ones may still be underway, and so may those from before the 400 ms.
            told = self.told_since(begin, odometry, 40)
            now = self.state()
            runs.append((told, repr(now.pose), repr(now.twist)))
            gazebo("reset_world")
            self.step(30)
            self.assertTrue(gazebo("restore_state", name="driving").success)
        self.assertEqual(runs[0], runs[1])

    def test_a_diff_drive_controller_drives_and_tells(self):
        params = COVARIANCES | {
            "type": "diff_drive_controller/DiffDriveController", "left_wheel": "left_joint",
            "right_wheel": "right_joint", "publish_cmd": True, "cmd_vel_timeout": 100.0,
        }  # fmt: skip
        rospy.set_param("/base", params)
        self.begin(two_wheels(**CONTROL))
        manager = Manager()
        self.assertIn(params["type"], manager.types().types)
        self.assertTrue(wait_until(lambda: manager.start("base")))
        odometry, tf = self.hear("/base/odom", Odometry), self.hear("/tf", TFMessage)
        commands = self.hear("/base/cmd_vel_out", TwistStamped)
        self.step(100)
        self.assertEqual(self.stamps(odometry, 4), [21, 41, 61, 81])
        self.follow("/base/cmd_vel", Twist(linear=Vector3(x=0.2)), odometry)
        tuner = DynamicClient("/base", timeout=BOUND)
        self.addCleanup(tuner.close)
        tuned = tuner.update_configuration({"wheel_separation_multiplier": 1.2})
        self.assertEqual((tuned["wheel_separation_multiplier"], tuned["publish_rate"]), (1.2, 50.0))
        self.step(2000)
        self.assertTrue(commands.wait_for(lambda each: each[-1].twist.linear.x == 0.2))
        self.assertAlmostEqual(self.newest(odometry).twist.twist.linear.x, 0.2, delta=1e-3)
        two_seconds = tf.wait_for(lambda each: each[-1].transforms[0].header.stamp.to_sec() >= 2.0)
        self.assertTrue(two_seconds)
        self.assertGreater(len(odometry.messages), 100)
        gazebo("reset_simulation")
        self.step(30)
        self.assertTrue(odometry.wait_for(lambda each: each[-1].header.stamp.to_nsec() == 21 * MS))
        self.assertEqual(self.stamps(odometry, 2)[-2:], [0, 21])
        place = odometry.messages[-1].pose.pose.position
        self.assertAlmostEqual(place.x, 0.0, delta=1e-3)

    def test_four_wheels_steer_by_their_own_message(self):
        corners = [f"{side}_{end}" for end in ("front", "rear") for side in ("left", "right")]
        rospy.set_param("/base", COVARIANCES | {
            "type": "four_wheel_steering_controller/FourWheelSteeringController",
            "front_wheel": [f"{each}_joint" for each in corners[:2]],
            "rear_wheel": [f"{each}_joint" for each in corners[2:]],
            "front_steering": [f"{each}_steering" for each in corners[:2]],
            "rear_steering": [f"{each}_steering" for each in corners[2:]],
            "cmd_vel_timeout": 100.0,
        })  # fmt: skip
        self.begin(four_wheels(steered=tuple(corners), **CONTROL))
        self.assertTrue(wait_until(lambda: Manager().start("base")))
        odometry = self.hear("/base/odom", Odometry)
        steering = self.hear("/base/odom_steer", FourWheelSteeringStamped)
        self.step(100)
        command = FourWheelSteering(speed=0.2, front_steering_angle=0.3, rear_steering_angle=-0.3)
        self.follow("/base/cmd_four_wheel_steering", command, odometry)
        self.step(1000)
        steered = steering.wait_for(lambda got: abs(got[-1].data.rear_steering_angle + 0.3) < 0.02)
        self.assertTrue(steered)
        self.assertGreater(self.newest(odometry).twist.twist.angular.z, 0.2)

    def test_controllers_report_an_imu_and_a_joints_forces(self):
        imu = '<gazebo reference="base"><sensor name="imu" type="imu"/></gazebo>'
        force = '<gazebo reference="left_joint"><sensor name="hub/ft" type="force_torque"/></gazebo>'
        for name in ("imu", "force_torque"):
            kind = "".join(part.title() for part in (*name.split("_"), "sensor", "controller"))
            params = {"type": f"{name}_sensor_controller/{kind}", "publish_rate": 50}
            rospy.set_param(f"/{name}_reporter", params)
        self.begin(two_wheels(**CONTROL).replace("</robot>", f"{imu}{force}</robot>"))
        manager = Manager()
        self.assertTrue(wait_until(lambda: manager.start("imu_reporter", "force_torque_reporter")))
        heard = self.hear("/imu", Imu), self.hear("/hub/ft", WrenchStamped)
        self.step(500)
        felt, borne = map(self.newest, heard)
        self.assertAlmostEqual(felt.linear_acceleration.z, 9.8, delta=0.5)
        self.assertEqual((felt.header.frame_id, borne.header.frame_id), ("base", "left_wheel"))
        gazebo("reset_simulation")
        for each in heard:
            self.assertTrue(each.wait_for(lambda them: them[-1].header.stamp.to_nsec() == 0))
        self.step(100)
        for each in heard:
            self.newest(each)
        self.assertTrue(manager.switch([], ["imu_reporter"], STRICT))
        self.assertTrue(manager.unload("imu_reporter"))


if __name__ == "__main__":
    rospy.init_node("drives_test")
    rostest.rosrun("cartpole", "drives", "__main__")
