"""Services that report, change and place links: each text, failure and effect."""

import math

import rospy
from gazebo_msgs.msg import LinkState
from gazebo_msgs.srv import GetLinkPropertiesResponse, SetLinkPropertiesRequest
from gazebo_world import INF, NAN, SCOPE, GazeboTest, run
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3, Wrench
from support.ros.calls import gazebo, joint


class LinksTest(GazeboTest):
    def test_link_properties(self):
        text = "GetLinkProperties: got properties"
        found = self.succeeds(text, "get_link_properties", "cartpole::pole")
        self.assertEqual((found.mass, found.gravity_mode), (0.23243, True))
        self.assertEqual((found.com.position.z, found.com.orientation.w), (0.25293, 1.0))
        self.assertEqual(found.ixx, 0.00438754518582167)
        text = f"GetLinkProperties: link not found, {SCOPE}"
        for name in ("cartpole", "box::body::body_collision", "cart_pole", ""):
            self.fails(text, "get_link_properties", name)

    def set_box(self, **changes):
        request = SetLinkPropertiesRequest("box::body", Pose(), True, 2.0, 0.1, 0, 0, 0.1, 0, 0.1)
        for key, value in changes.items():
            setattr(request, key, value)
        return "set_link_properties", request

    def test_set_link_properties(self):
        com = Pose(position=Point(0.1, 0, 0), orientation=Quaternion(9, 9, 9, 9))
        text = "SetLinkProperties: properties set"
        self.succeeds(text, *self.set_box(mass=4.0, com=com, gravity_mode=False, ixy=0.01))
        found = gazebo("get_link_properties", "box::body")
        self.assertEqual((found.mass, found.gravity_mode, found.ixy), (4.0, False, 0.01))
        self.assertEqual(found.com, Pose(Point(0.1, 0, 0), Quaternion(0, 0, 0, 1)))
        wrench = Wrench(force=Vector3(8.0, 0, 0))
        gazebo("apply_body_wrench", "box::body", "", Point(), wrench, rospy.Time(), rospy.Duration(-1))
        time = run(0.2)
        found = self.box().twist.linear
        self.assertAlmostEqual(found.x, 8.0 / 4.0 * time, places=2)
        self.assertAlmostEqual(found.z, 0.0, places=6)

    def test_set_link_properties_failures(self):
        text = f"SetLinkProperties: link not found, {SCOPE}"
        self.fails(text, *self.set_box(link_name="nobody", mass=NAN))
        before = gazebo("get_link_properties", "box::body")
        for changes in ({"mass": NAN}, {"mass": 0.0}, {"mass": -2.0}, {"ixx": -1.0}, {"izz": INF},
                        {"ixy": 5.0}, {"com": Pose(position=Point(NAN, 0, 0))}):  # fmt: skip
            self.refuses("SetLinkProperties: .*(mass|izz|position.x)", *self.set_box(**changes))
        self.assertEqual(gazebo("get_link_properties", "box::body"), before)
        self.assertIsInstance(before, GetLinkPropertiesResponse)

    def test_link_state(self):
        answer = self.succeeds("GetLinkState: got state", "get_link_state", "pole", "cartpole::cart")
        state = answer.link_state
        self.assertEqual((state.link_name, state.reference_frame), ("pole", "cartpole::cart"))
        self.assertAlmostEqual(state.pose.position.z, 0.03, places=6)
        self.fails(f"GetLinkState: link not found, {SCOPE}", "get_link_state", "nobody", "nowhere")
        text = f"GetLinkState: reference reference_frame not found, {SCOPE}"
        self.fails(text, "get_link_state", "pole", "nowhere")

    def test_set_link_state_projects_onto_the_joints(self):
        pose = Pose(Point(0.2, 0, 0.18), Quaternion(0, -math.sin(0.2), 0, math.cos(0.2)))
        twist = Twist(Vector3(0.1, 0, 0), Vector3(0, -1.0, 0))
        state = LinkState("cartpole::pole", pose, twist, "world")
        self.succeeds("SetLinkState: success", "set_link_state", state)
        for name, wanted in (("stand_cart", (0.2, 0.1)), ("cart_pole", (0.4, 1.0))):
            for got, value in zip(joint(name), wanted, strict=True):
                self.assertAlmostEqual(got, value, places=5)

    def test_set_link_state_frames_and_failures(self):
        pose = Pose(position=Point(1.0, 0, 1.0))
        self.assertTrue(gazebo("set_link_state", LinkState("body", pose, Twist(), "stand")).success)
        self.assertEqual(self.box().pose.position, Point(1.0, 0, 1.0))
        state = LinkState("box", pose, Twist(), "")
        self.fails("SetLinkState: link does not exist", "set_link_state", state)
        for frame in ("cartpole", "nowhere", "body_collision"):
            state = LinkState("body", pose, Twist(), frame)
            self.fails("SetLinkState: failed", "set_link_state", state)
        twist = Twist(angular=Vector3(y=NAN))
        self.refuses("angular.y is nan", "set_link_state", LinkState("body", pose, twist, ""))

    def test_set_link_state_takes_the_frames_velocity_away(self):
        gazebo("set_link_state", LinkState("cart", Pose(), Twist(linear=Vector3(0.5, 0, 0)), ""))
        gazebo("set_link_state", LinkState("body", Pose(), Twist(), "cart"))
        self.assertAlmostEqual(self.box().twist.linear.x, -0.5, places=6)

    def test_link_state_in_other_frames(self):
        heights = {"cartpole": 0.18, "/map": 0.18, "cartpole::cart": 0.03, "pole": 0.0}
        for frame, z in heights.items():
            found = gazebo("get_link_state", "cartpole::pole", frame).link_state
            self.assertAlmostEqual(found.pose.position.z, z, places=6)
            self.assertEqual((found.link_name, found.reference_frame), ("cartpole::pole", frame))
        found = gazebo("get_link_state", "pole", "body_collision").link_state
        self.close([(found.pose.position.x, -3.0), (found.pose.position.z, 0.18 - 20.0)])

    def test_link_state_twist_is_relative_and_turned(self):
        quarter = Quaternion(0, 0, math.sqrt(0.5), math.sqrt(0.5))
        twist = Twist(Vector3(1.0, 0, 0), Vector3(0, 0, 2.0))
        gazebo("set_link_state", LinkState("body", Pose(Point(3, 0, 20), quarter), twist, ""))
        found = gazebo("get_link_state", "cart", "body").link_state.twist
        self.close([(found.linear.y, 1.0), (found.angular.z, -2.0), (found.linear.x, 0.0)])
