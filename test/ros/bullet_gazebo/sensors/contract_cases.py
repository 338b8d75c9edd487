"""What the contract asks of sensors, one after the other (docs/contract/sensors.md)."""

import itertools
import math
import signal
import subprocess

import numpy as np
from gazebo_msgs.msg import ContactsState, LinkState, ModelState
from geometry_msgs.msg import Point, Pose, WrenchStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_case import MS, UPRIGHT, SensorCase
from sensor_msgs.msg import CameraInfo, Image, Imu, LaserScan, PointCloud, PointCloud2, Range
from support.memory import resident
from support.ros.calls import gazebo, process_of

G = 9.8  # [m/s²]
TILTED = """<sdf version="1.6"><model name="steady"><static>1</static><link name="l"/>
<link name="tilted"><pose>0 0 0.5 0 -0.5235987755982988 0</pose><sensor name="i" type="imu"><update_rate>100
</update_rate><plugin name="e" filename="libgazebo_ros_imu_sensor.so"><topicName>tilted</topicName>
<frameName>f</frameName><updateRateHZ>100</updateRateHZ></plugin></sensor></link>
<plugin name="f" filename="libgazebo_ros_imu.so"><bodyName>tilted</bodyName><topicName>tilted_old</topicName>
</plugin><plugin name="g" filename="libhector_gazebo_ros_imu.so"><bodyName>tilted</bodyName>
<topicName>tilted_hector</topicName></plugin><plugin name="h" filename="libhector_gazebo_ros_imu.so">
<bodyName>l</bodyName><rpyOffset>0 -0.5235987755982988 0</rpyOffset><topicName>turned_hector</topicName>
</plugin></model></sdf>"""
LUMPED = """<robot name="r"><link name="base"><inertial><mass value="9"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="pad"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/>
</inertial><collision><geometry><box size=".3 .3 .1"/></geometry></collision></link>
<joint name="j" type="fixed"><parent link="base"/><child link="pad"/></joint>
<gazebo reference="pad"><sensor name="touch" type="contact"><contact><collision>pad_collision</collision>
</contact><plugin name="p" filename="libgazebo_ros_bumper.so"><bumperTopicName>touched</bumperTopicName>
</plugin></sensor></gazebo></robot>"""
LARGE = """<sdf version="1.6"><model name="large"><static>1</static><link name="l">
<sensor name="s" type="depth"><pose>0 0 0.3 0 0 0</pose>
<update_rate>100</update_rate><camera><image><width>320</width><height>240</height>
</image></camera><plugin name="p" filename="libgazebo_ros_openni_kinect.so"><cameraName>large</cameraName>
</plugin></sensor></link></model></sdf>"""
TOPICS = {  # of the bot: type, and period [ms]
    "/scan": (LaserScan, 100), "/cloud": (PointCloud2, 100), "/block": (PointCloud, 100),
    "/range": (Range, 100), "/sonar": (Range, 100), "/bumper_states": (ContactsState, 10),
    "/imu_data": (Imu, 20), "/old_imu": (Imu, 10), "/hector": (Imu, 20), "/truth": (Odometry, 10),
    "/wrist": (WrenchStamped, 10), "/net": (WrenchStamped, 1), "/eye/image_raw": (Image, 100),
    "/eye/camera_info": (CameraInfo, 100), "/kinect/depth/image_raw": (Image, 100),
    "/kinect/depth/camera_info": (CameraInfo, 100), "/pair/left/image_raw": (Image, 100),
    "/d435/depth/image_raw": (Image, 100),
}  # fmt: skip


class Felt(SensorCase):
    """What depends on the engine."""

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

    def test_tilted_imus(self):
        self.spawn("st", TILTED, kind="sdf", x=-20.0)
        expected = np.array([math.sin(math.radians(30.0)), 0.0, math.cos(math.radians(30.0))])
        topics = {"/tilted": G, "/tilted_hector": G, "/turned_hector": G, "/tilted_old": 0.0}
        for topic, share in topics.items():
            felt = self.newest(topic, Imu).linear_acceleration
            np.testing.assert_allclose((felt.x, felt.y, felt.z), share * expected, atol=1e-6)

    def test_a_lifted_bumper_feels_nothing_and_a_lumped_one_works(self):
        self.spawn("lumped", LUMPED, x=-5.0, z=0.06)
        self.step(1000)
        heard = self.hear("/touched", ContactsState)
        now = self.step(100)
        heard.from_time(now)
        forces = [message.states[0].total_wrench.force.z for message in heard.messages[-50:]]
        self.assertAlmostEqual(float(np.mean(forces)), 10 * G, delta=0.1)
        self.put(z=5.0)
        self.assertEqual(self.newest("/bumper_states", ContactsState, 20).states, [])

    def test_a_wrist_bears_what_hangs_on_it(self):
        """A mass of 1 kg hangs 0.1 m beside it."""
        heard, net = self.hear("/wrist", WrenchStamped), self.hear("/net", WrenchStamped)
        now = self.step(2000)
        message = heard.from_time(now)
        self.assertEqual(message.header.frame_id, "tip")
        force, torque = message.wrench.force, message.wrench.torque
        np.testing.assert_allclose((force.x, force.y, force.z), (0, 0, -G), atol=0.1)
        np.testing.assert_allclose((torque.x, torque.y, torque.z), (0, 0.1 * G, 0), atol=0.02)
        self.assertEqual(net.from_time(now).header.frame_id, "world")
        self.assertAlmostEqual(net.messages[-1].wrench.force.z, 0.0, delta=0.1)

    def test_truth_period_by_period(self):
        heard = self.hear("/truth", Odometry)
        self.put(z=5.0, turning=1.0)
        for number in range(1, 6):
            self.step(9)
            state = gazebo("get_link_state", "bot::base", "world").link_state
            message = heard.from_time(self.step(1))
            self.assertEqual(message.header.stamp.to_nsec(), number * 10 * MS)
            self.assertEqual(message.pose.pose, state.pose)
            self.assertEqual(message.twist.twist, state.twist)
        self.assertEqual((message.header.frame_id, message.child_frame_id), ("world", "base"))


class Contract(SensorCase):
    def test_a_wrong_collision_of_a_bumper_is_a_warning_in_rosout(self):
        heard = self.hear("/rosout", Log)
        self.spawn("wrong", LUMPED.replace("pad_collision", "nonsense"), x=-5.0, z=5.0)
        self.assertTrue(heard.wait_for(lambda got: any("nonsense" in each.msg for each in got)))
        [told] = [each for each in heard.messages if "nonsense" in each.msg]
        self.assertEqual((told.level, told.name), (Log.WARN, "/gazebo"))

    def test_nothing_falls_silent_when_time_is_reset(self):
        heard = {topic: self.hear(topic, kind) for topic, (kind, _) in TOPICS.items()}
        self.step(500)
        for each in heard.values():
            each.from_time(400 * MS)
        gazebo("reset_simulation")
        self.step(110)
        for topic, (_, period) in TOPICS.items():
            each = heard[topic]
            assert each.wait_for(lambda messages: 0 < stamp(messages[-1]) <= 110 * MS), topic
            times = [stamp(message) for message in each.messages]
            after = times[next(i for i in range(1, len(times)) if times[i] < times[i - 1]) :]
            self.assertLessEqual(after[0], period * MS, topic)
            # Which is measured at once, an IMU too, goes on with its period.
            gaps = {later - earlier for earlier, later in itertools.pairwise(after)}
            self.assertLessEqual(max(gaps), 2 * period * MS, topic)

    def test_a_subscriber_that_stops_reading_costs_no_memory(self):
        """120 MB of clouds are sent to it."""
        self.spawn("large", LARGE, kind="sdf", x=-5.0)
        heard = self.hear("/large/depth/image_raw", Image, read=stamp)
        with subprocess.Popen(
            ["rostopic", "echo", "--noarr", "/large/points/header"], stdout=subprocess.PIPE
        ) as stopped:
            try:
                assert stopped.stdout.readline()  # a newcomer's
                stopped.send_signal(signal.SIGSTOP)
                before = resident(process_of())
                for _ in range(5):
                    now = self.step(100)
                assert heard.wait_for(lambda stamps: stamps[-1] >= now)
                self.assertLess(resident(process_of()) - before, 60e6)
            finally:
                stopped.kill()
        now = self.step(20)
        assert heard.wait_for(lambda stamps: stamps[-1] >= now)

    def test_whatever_moves_the_bot_brings_a_fresh_scan(self):
        heard = self.hear("/scan", LaserScan)
        self.step(150)
        heard.after(2)  # the newcomer's, and that of 100 ms
        topic = self.publisher("/gazebo/set_model_state", ModelState)
        pose = Pose(Point(0.25, 0.0, 0.0), UPRIGHT)
        link = LinkState("bot::base", Pose(Point(0.5, 0.0, 0.05), UPRIGHT), None, "world")
        link.twist = ModelState().twist
        for move, expected in (
            (lambda: self.put(x=0.75), 0.75),
            (lambda: topic.publish(ModelState("bot", pose, ModelState().twist, "world")), 1.25),
            (lambda: gazebo("set_link_state", link), 1.0),
            (lambda: gazebo("reset_world"), 1.5),
        ):
            count = len(heard.messages)
            move()
            message = heard.after(count + 1)[count]
            self.assertEqual(stamp(message), 150 * MS)
            self.assertAlmostEqual(message.ranges[0], expected, delta=0.05)


def stamp(message):
    return message.header.stamp.to_nsec()
