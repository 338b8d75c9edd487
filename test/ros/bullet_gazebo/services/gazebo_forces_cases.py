"""Services that apply and clear efforts and wrenches."""

import rospy
from gazebo_world import BOX, INF, NAN, GazeboTest, physics, run
from geometry_msgs.msg import Point, Vector3, Wrench
from support.ros.calls import gazebo, joint, sim_time


class ForcesTest(GazeboTest):
    def test_apply_joint_effort(self):
        gazebo("set_physics_properties", physics(gravity=Vector3()))
        text = "ApplyJointEffort: effort set"
        push = ("apply_joint_effort", "cart_pole")
        for duration in (rospy.Duration(0), rospy.Duration(0, 999_999)):
            self.succeeds(text, *push, 1.0, rospy.Time(), duration)
        run(0.02)
        self.assertEqual(joint("cart_pole")[1], 0.0)
        self.succeeds(text, *push, 0.1, rospy.Time(), rospy.Duration(0.05))
        start = rospy.Time.from_sec(sim_time() + 1.0)
        self.succeeds(text, *push, 0.1, start, rospy.Duration(-1))
        run(0.1)
        position, rate = joint("cart_pole")
        self.assertGreater(rate, 0.1)
        run(0.1)
        self.assertAlmostEqual(joint("cart_pole")[1], rate, delta=0.05)
        gazebo("clear_joint_forces", "cartpole::cart_pole")  # matches nothing
        run(1.0)
        self.assertGreater(joint("cart_pole")[1], rate + 0.1)
        gazebo("clear_joint_forces", "cart_pole")
        gazebo("reset_simulation")
        run(0.05)
        self.assertEqual(joint("cart_pole"), (0.0, 0.0))
        gazebo("set_physics_properties", physics())

    def test_apply_joint_effort_failures(self):
        late = (rospy.Time(), rospy.Duration(1))
        self.fails("ApplyJointEffort: joint not found", "apply_joint_effort", "elbow", NAN, *late)
        for effort in (NAN, INF, 1e300):
            self.refuses("ApplyJointEffort: effort is", "apply_joint_effort", "cart_pole", effort, *late)

    def test_apply_body_wrench(self):
        forever, wrench = rospy.Duration(-1), Wrench(force=Vector3(0, 0, 2.0 * 9.8))
        args = ("box::body", "world", Point(), wrench, rospy.Time(), forever)
        self.succeeds("", "apply_body_wrench", *args)
        run(0.1)
        self.assertAlmostEqual(self.box().twist.linear.z, 0.0, places=4)
        wrench = Wrench(force=Vector3(1.0, 0, 2.0 * 9.8))  # takes the other one's place
        gazebo("apply_body_wrench", "body", "", Point(0, 0, 1), wrench, rospy.Time(), forever)
        time = run(0.1)
        found = self.box().twist
        self.assertAlmostEqual(found.linear.x, 0.5 * time, places=4)
        self.assertAlmostEqual(found.linear.z, 0.0, places=4)
        self.assertAlmostEqual(found.angular.y, 1.0 / 0.1 * time, delta=0.2)
        gazebo("clear_body_wrenches", "body")  # matches nothing
        gazebo("clear_body_wrenches", "box::body")
        speed = self.box().twist.linear
        time = run(0.1)
        found = self.box().twist.linear
        self.assertAlmostEqual(found.x, speed.x, places=6)
        self.assertAlmostEqual(found.z, speed.z - 9.8 * time, places=3)

    def test_apply_body_wrench_failures(self):
        rest = (Point(), Wrench(force=Vector3(x=NAN)), rospy.Time(), rospy.Duration(-1))
        self.fails("ApplyBodyWrench: body does not exist", "apply_body_wrench", "box", "nowhere", *rest)
        self.fails("ApplyBodyWrench: reference_frame not found",
                   "apply_body_wrench", "body", "nowhere", *rest)  # fmt: skip
        self.refuses("ApplyBodyWrench: wrench.force.x is nan", "apply_body_wrench", "body", "box", *rest)

    def without_gravity(self):
        gazebo("set_physics_properties", physics(gravity=Vector3()))
        self.addCleanup(gazebo, "set_physics_properties", physics())

    def push(self, force, start=0.0, duration=0.0, frame="", point=(0, 0, 0)):
        wrench = Wrench(force=Vector3(*force))
        gazebo("apply_body_wrench", "box::body", frame, Point(*point), wrench,
             rospy.Time.from_sec(start), rospy.Duration.from_sec(duration))  # fmt: skip

    def test_a_wrench_acts_for_exactly_as_many_steps_as_its_time_holds(self):
        self.without_gravity()
        for duration, later, steps in ((0.0, 0.0, 0), (0.0009, 0.0, 0), (0.05, 0.0, 50), (0.0105, 0.0, 10),
                                       (0.05, 0.01, 51), (0.0, 0.01, 1)):  # fmt: skip
            gazebo("reset_world")
            self.push((2.0, 0, 0), sim_time() + later if later else 0.0, duration)
            run(0.08)
            # 2 N on 2 kg
            self.assertAlmostEqual(self.box().twist.linear.x, steps * 0.001, places=6)

    def test_a_wrench_in_a_bodys_frame_has_that_frames_arm(self):
        self.without_gravity()
        self.push((0, 0.001, 0), duration=0.01, frame="cartpole::stand")
        run(0.03)
        found = self.box().twist  # X.pos is (-3, 0, -20): the torque is X.pos x force
        self.close([(found.linear.y, 0.001 / 2.0 * 0.01), (found.angular.x, 0.02 / 0.1 * 0.01),
                    (found.angular.z, -0.003 / 0.1 * 0.01)], places=5)  # fmt: skip

    def test_resets_keep_what_is_applied(self):
        self.without_gravity()
        self.push((2.0, 0, 0), duration=-1.0)
        gazebo("reset_world")
        time = run(0.02)
        self.assertAlmostEqual(self.box().twist.linear.x, time, places=6)
        gazebo("reset_simulation")  # its start is not adjusted: it sleeps until time has caught up
        run(0.0)
        self.assertEqual(self.box().twist.linear.x, 0.0)
        gazebo("clear_body_wrenches", "box::body")

    def test_a_deleted_model_takes_its_forces_and_the_efforts_on_joints_of_its_names_along(self):
        self.without_gravity()
        self.push((5.0, 0, 0), duration=-1.0)
        gazebo("delete_model", "box")
        self.spawn("box", BOX, x=3.0, z=20.0)
        self.spawn("twin", rospy.get_param("/robot_description"), "/twin", y=5.0)
        gazebo("apply_joint_effort", "cartpole::cart_pole", 0.1, rospy.Time(), rospy.Duration(-1))
        gazebo("delete_model", "twin")
        run(0.02)
        self.assertEqual(joint("cartpole::cart_pole")[1], 0.0)
        self.assertEqual(self.box().twist.linear.x, 0.0)
