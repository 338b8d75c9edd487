"""Services that report and place models: each text, failure and effect."""

import math

import rospy
from gazebo_msgs.msg import LinkState, ModelState
from gazebo_world import BOX, INF, NAN, GazeboTest, run
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from support.ros.calls import delete_model, gazebo, joint, model_names, sim_time, wait_until


class ModelsTest(GazeboTest):
    def test_model_properties(self):
        found = self.succeeds("GetModelProperties: got properties", "get_model_properties", "cartpole")
        self.assertEqual(found.body_names, ["stand", "cart", "pole"])
        self.assertEqual(found.joint_names, ["grounding", "stand_cart", "cart_pole"])
        self.assertEqual((found.canonical_body_name, found.parent_model_name), ("", ""))
        self.assertEqual((found.child_model_names, found.is_static), ([], False))
        plane = gazebo("get_model_properties", "ground_plane")
        self.assertEqual((plane.geom_names, plane.is_static), (["collision"], True))
        self.assertEqual(gazebo("get_model_properties", "box").geom_names, ["body_collision"])
        text = "GetModelProperties: model does not exist"
        for name in ("nobody", "", "cartpole::cart"):
            self.fails(text, "get_model_properties", name)

    def test_set_model_state(self):
        turn = Quaternion(0.0, 0.0, 2.0, 2.0)  # a quarter turn, not normalised
        pose, twist = Pose(Point(1.0, 2.0, 30.0), turn), Twist(Vector3(0.5, 0, 0), Vector3(0, 0, 1))
        state = ModelState("box", pose, twist, "")
        self.succeeds("SetModelState: set model state done", "set_model_state", state)
        found = self.box()
        self.assertEqual(found.pose.position, Point(1.0, 2.0, 30.0))
        self.assertAlmostEqual(found.pose.orientation.z, math.sqrt(0.5))
        self.assertAlmostEqual(found.twist.linear.x, 0.5)
        self.assertAlmostEqual(found.twist.angular.z, 1.0)

    def test_set_model_state_in_a_frame(self):
        turned = Pose(Point(0, 0, 0), Quaternion(0, 0, math.sqrt(0.5), math.sqrt(0.5)))
        gazebo("set_model_state", ModelState("cartpole", turned, Twist(), "world"))
        twist = Twist(Vector3(1.0, 0, 0), Vector3(0, 1.0, 0))
        state = ModelState("box", Pose(position=Point(1.0, 0, 5.0)), twist, "cartpole::cart")
        self.assertTrue(gazebo("set_model_state", state).success)
        found = self.box()
        for got, wanted in ((found.pose.position.y, 1.0), (found.pose.position.z, 5.15),
                            (found.twist.linear.y, 1.0), (found.twist.angular.x, -1.0)):  # fmt: skip
            self.assertAlmostEqual(got, wanted, places=6)

    def test_set_model_state_takes_joint_velocities_away(self):
        gazebo("set_model_configuration", "cartpole", "", ["cart_pole"], [0.3])
        run(0.2)
        position, rate = joint("cart_pole")
        self.assertNotEqual(rate, 0.0)
        gazebo("set_model_state", ModelState(model_name="cartpole"))
        self.assertEqual(joint("cart_pole"), (position, 0.0))

    def test_set_model_state_failures(self):
        text = "SetModelState: model does not exist"
        self.fails(text, "set_model_state", ModelState("nobody", Pose(), Twist(), "nowhere"))
        self.fails("SetModelState: specified reference frame entity does not exist",
                   "set_model_state", ModelState("box", Pose(), Twist(), "nowhere"))  # fmt: skip
        before = self.box()
        for position, twist in ((Point(NAN, 0, 0), 0.0), (Point(), INF), (Point(1e300, 0, 0), 0.0)):
            state = ModelState("box", Pose(position=position), Twist(linear=Vector3(z=twist)), "")
            self.refuses("SetModelState: .*(position.x|linear.z) is", "set_model_state", state)
        self.assertEqual((self.box().pose, self.box().twist), (before.pose, before.twist))

    def test_the_topics_do_what_the_services_do(self):
        model = rospy.Publisher("/gazebo/set_model_state", ModelState, queue_size=1)
        link = rospy.Publisher("/gazebo/set_link_state", LinkState, queue_size=1)
        for publisher in (model, link):
            self.assertTrue(wait_until(publisher.get_num_connections))
        model.publish(ModelState("nobody", Pose(), Twist(), ""))
        model.publish(ModelState("box", Pose(position=Point(7.0, 0, 9.0)), Twist(), ""))
        self.assertTrue(wait_until(lambda: self.box().pose.position.x == 7.0))
        link.publish(LinkState("box::body", Pose(position=Point(8.0, 0, 9.0)), Twist(), "map"))
        self.assertTrue(wait_until(lambda: self.box().pose.position.x == 8.0))

    # names and frames

    def test_a_plain_name_is_the_first_ones(self):
        self.spawn("twin", BOX, x=5.0, z=20.0)
        for name, x in {"body": 3.0, "box::body": 3.0, "twin::body": 5.0}.items():
            found = gazebo("get_link_state", name, "world")
            self.assertEqual((found.success, found.link_state.pose.position.x), (True, x))
        self.assertFalse(gazebo("get_link_state", "body_collision", "world").success)

    def test_a_model_named_as_an_earlier_link_is_not_found(self):
        self.spawn("cart", BOX, x=5.0, z=20.0)
        self.addCleanup(delete_model, "cartpole")  # its link hides the other one from deletion, too
        self.assertIn("cart", model_names())
        self.fails("GetModelState: model does not exist", "get_model_state", "cart", "")

    def test_the_worlds_names_unless_a_model_has_them(self):
        for frame in ("", "world", "map", "/map"):
            found = self.box(frame)
            self.assertEqual((found.pose.position.x, found.header.frame_id), (3.0, frame))
        self.spawn("map", BOX, x=1.0, z=20.0)
        self.close([(self.box("map").pose.position.x, 2.0), (self.box("map").pose.position.z, 0.0)])

    def test_model_state_in_the_frame_of_a_model_link_or_collision(self):
        turned = Pose(Point(1, 0, 20), Quaternion(0, 0, math.sqrt(0.5), math.sqrt(0.5)))
        self.spawn("frame", BOX)
        twist = Twist(Vector3(0, 1, 0), Vector3(0, 0, 2))
        gazebo("set_model_state", ModelState("frame", turned, twist, ""))
        twist = Twist(linear=Vector3(5, 0, 0))
        gazebo("set_model_state", ModelState("box", self.box().pose, twist, ""))
        for name in ("frame", "frame::body", "frame::body::body_collision"):
            found = self.box(name)
            # 2 m before it along the world's x, its y; no ω × r in the twist
            self.close([(found.pose.position.x, 0.0), (found.pose.position.y, -2.0),
                        (found.pose.orientation.z, -math.sqrt(0.5)), (found.twist.linear.x, -1.0),
                        (found.twist.linear.y, -5.0), (found.twist.angular.z, -2.0)])  # fmt: skip

    def test_the_header_counts_calls_for_a_name_and_has_the_time(self):
        run(0.01)
        first = self.box()
        self.assertAlmostEqual(first.header.stamp.to_sec(), sim_time(), places=9)
        gazebo("get_model_state", "cartpole", "")
        text = (
            "GetModelState: reference relative_entity_name not found, "
            "did you forget to scope the body by model name?"
        )
        lost = self.fails(text, "get_model_state", "box", "nowhere")
        self.assertEqual((lost.header.seq, lost.header.frame_id), (first.header.seq + 1, "nowhere"))
        gone = gazebo("get_model_state", "nobody", "")
        self.assertEqual((gone.header.seq, gone.header.frame_id), (0, ""))
        gazebo("reset_simulation")
        self.assertEqual(self.box().header.seq, first.header.seq + 2)
