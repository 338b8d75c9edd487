"""Services that report, change and place joints; resets."""

import threading

import rospy
from gazebo_msgs.msg import LinkState, LinkStates, ModelState, ODEJointProperties
from gazebo_world import BOX, INF, NAN, GazeboTest, run
from geometry_msgs.msg import Point, Pose, Twist, Vector3
from rosgraph_msgs.msg import Clock, Log
from support.ros.calls import BOUND, gazebo, joint, sim_time, wait_until
from support.ros.subscribed import wait_until_heard


class JointsTest(GazeboTest):
    def test_set_joint_properties(self):
        text = "SetJointProperties: properties set"
        stops = ODEJointProperties(loStop=[-0.1], hiStop=[0.1, 7.0], erp=[0.3], fudge_factor=[1.0])
        self.succeeds(text, "set_joint_properties", "cartpole::stand_cart", stops)
        gazebo("set_model_configuration", "cartpole", "", ["stand_cart"], [0.4])
        self.assertEqual(joint("stand_cart")[0], 0.1)
        self.succeeds(text, "set_joint_properties", "cart_pole", ODEJointProperties(damping=[100.0]))
        gazebo("set_model_configuration", "cartpole", "", ["cart_pole"], [0.3])
        run(0.1)
        self.assertLess(abs(joint("cart_pole")[1]), 0.5)
        self.succeeds(text, "set_joint_properties", "grounding", ODEJointProperties(damping=[1.0]))
        found = gazebo("get_joint_properties", "cart_pole")
        self.assertEqual((found.type, list(found.damping)), (0, []))

    def test_set_joint_properties_failures(self):
        text = "SetJointProperties: joint not found"
        for name in ("elbow", "", "cart"):
            self.fails(text, "set_joint_properties", name, ODEJointProperties())
        for config in (ODEJointProperties(damping=[NAN]), ODEJointProperties(hiStop=[0.1, INF]),
                       ODEJointProperties(damping=[-1.0]), ODEJointProperties(fmax=[-1.0])):  # fmt: skip
            self.refuses("SetJointProperties: .*(damping|hiStop|fmax)",
                         "set_joint_properties", "cart_pole", config)  # fmt: skip

    def test_a_fixed_joint_stands_at_zero(self):
        self.assertEqual(joint("cartpole::grounding"), (0.0, 0.0))

    # set_model_configuration

    def test_configuration_takes_scoped_names_and_the_last_of_two(self):
        self.succeeds("SetModelConfiguration: success", "set_model_configuration", "cartpole", "",
                      ["cartpole::stand_cart", "cart_pole", "cart_pole"], [0.3, 0.1, 0.2])  # fmt: skip
        self.assertEqual((joint("stand_cart")[0], joint("cart_pole")[0]), (0.3, 0.2))

    def test_configuration_beyond_a_stop_is_logged(self):
        heard = []
        rosout = rospy.Subscriber("/rosout", Log, lambda log: heard.append(log.msg))
        wait_until(lambda: rosout.get_num_connections() > 0)
        gazebo("set_model_configuration", "cartpole", "", ["stand_cart"], [45.0])
        stop = joint("stand_cart")[0]
        text = f"joint 'stand_cart' of 'cartpole' can't be at 45: it is at its stop, {stop:g}"
        self.assertTrue(wait_until(lambda: any(text in each for each in heard)), heard)
        rosout.unregister()

    def test_configuration_stops_what_the_joint_carries_and_nothing_else(self):
        twist = Twist(Vector3(0.5, 0, 0), Vector3(0, 1.0, 0))
        gazebo("set_link_state", LinkState("pole", Pose(position=Point(0, 0, 0.18)), twist, ""))
        self.assertNotEqual(joint("cart_pole")[1], 0.0)
        gazebo("set_model_configuration", "cartpole", "", ["cart_pole"], [0.1])
        self.close([(joint("cart_pole")[1], 0.0), (joint("stand_cart")[1], 0.5)])
        gazebo("set_model_configuration", "cartpole", "", ["stand_cart"], [0.1])
        self.close([(joint("stand_cart")[1], 0.0)])

    def test_services_that_place_leave_a_running_world_running(self):
        gazebo("unpause_physics")
        gazebo("set_model_configuration", "cartpole", "", ["cart_pole"], [0.1])
        gazebo("set_model_state", ModelState(model_name="box"))
        gazebo("reset_world")
        gazebo("reset_simulation")
        before = sim_time()
        self.assertTrue(wait_until(lambda: sim_time() > before))

    # resets

    def moved(self):
        gazebo("set_model_state", ModelState("box", Pose(position=Point(7, 7, 7)), Twist(), ""))
        gazebo("set_model_configuration", "cartpole", "", ["cart_pole"], [0.4])
        run(0.05)

    def check_reset(self):
        """The box is where it was spawned, at rest; everything spawned is there, and still paused."""
        found = self.box()
        self.assertEqual(found.pose.position, Point(3.0, 0.0, 20.0))
        self.assertEqual(found.twist, Twist())
        names = gazebo("get_world_properties").model_names
        self.assertEqual(names, ["ground_plane", "cartpole", "box"])
        self.assertTrue(gazebo("get_physics_properties").pause)

    def test_reset_world(self):
        self.spawn("short-lived", BOX, x=9.0, z=20.0)
        gazebo("delete_model", "short-lived")
        self.moved()
        time, (angle, rate) = sim_time(), joint("cart_pole")
        self.assertNotEqual(rate, 0.0)
        gazebo("reset_world")
        self.check_reset()
        self.assertEqual((sim_time(), joint("cart_pole")), (time, (angle, 0.0)))

    def test_reset_simulation(self):
        self.moved()
        gazebo("reset_simulation")
        self.check_reset()
        self.assertEqual((sim_time(), joint("cart_pole")), (0.0, (0.0, 0.0)))

    def test_states_are_those_before_the_step_and_the_clock_is_after_it(self):
        gazebo("reset_simulation")
        first, seen = {}, threading.Event()

        def keep(message):
            if first.setdefault(type(message), message) is message and len(first) == 2:
                seen.set()

        topics = [rospy.Subscriber("/clock", Clock, keep, queue_size=100),
                  rospy.Subscriber("/gazebo/link_states", LinkStates, keep, queue_size=100)]  # fmt: skip
        self.assertTrue(wait_until_heard("/clock", "/gazebo/link_states"))
        # rospy made the connection for its own subscription, which keeps the newest message only.
        for connection in topics[0].impl.connections:
            connection.protocol.queue_size = 100
        gazebo("unpause_physics")
        self.assertTrue(seen.wait(BOUND))
        gazebo("pause_physics")
        for topic in topics:
            topic.unregister()
        self.assertEqual(first[Clock].clock.to_nsec(), 1_000_000)
        states = first[LinkStates]
        links = ["ground_plane::link", "cartpole::stand", "cartpole::cart", "cartpole::pole"]
        self.assertEqual(states.name, [*links, "box::body"])
        self.assertEqual(len(states.name), len(states.pose))
        box = states.name.index("box::body")
        self.assertEqual((states.pose[box].position.z, states.twist[box].linear.z), (20.0, 0.0))
