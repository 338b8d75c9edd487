#!/usr/bin/env python3
"""The services that read and change the world: each text, failure and effect, over real ROS."""

import math
import unittest

import rospy
import rostest
from dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    ConfigDescription,
    DoubleParameter,
    IntParameter,
)
from dynamic_reconfigure.srv import Reconfigure
from gazebo_msgs.msg import LinkState, ModelState, ODEJointProperties, ODEPhysics
from gazebo_msgs.srv import (
    ApplyBodyWrench,
    ApplyJointEffort,
    BodyRequest,
    DeleteLight,
    DeleteModel,
    GetJointProperties,
    GetLightProperties,
    GetLinkProperties,
    GetLinkPropertiesResponse,
    GetLinkState,
    GetModelProperties,
    GetModelState,
    GetPhysicsProperties,
    GetWorldProperties,
    JointRequest,
    SetJointProperties,
    SetLightProperties,
    SetLinkProperties,
    SetLinkPropertiesRequest,
    SetLinkState,
    SetModelConfiguration,
    SetModelState,
    SetPhysicsProperties,
    SetPhysicsPropertiesRequest,
    SpawnModel,
)
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3, Wrench
from std_msgs.msg import ColorRGBA
from std_srvs.srv import Empty

BOUND = 20.0  # [s of wall time]
NAN, INF = float("nan"), float("inf")
SCOPE = "did you forget to scope the link by model name?"
BOX = """<robot name="box"><link name="body"><inertial><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>"""
KINDS = {kind.__name__: kind for kind in (
    ApplyBodyWrench, ApplyJointEffort, DeleteLight, DeleteModel, GetJointProperties,
    GetLightProperties, GetLinkProperties, GetLinkState, GetModelProperties, GetModelState,
    GetPhysicsProperties, GetWorldProperties, SetJointProperties, SetLightProperties,
    SetLinkProperties, SetLinkState, SetModelConfiguration, SetModelState, SetPhysicsProperties)}  # fmt: skip


def call(name, *args, kind=None, **kwargs):
    """Calls a service of Gazebo's; its type follows from its name where it isn't given."""
    rospy.wait_for_service(f"/gazebo/{name}", BOUND)
    kind = kind or KINDS["".join(word.capitalize() for word in name.split("_"))]
    return rospy.ServiceProxy(f"/gazebo/{name}", kind)(*args, **kwargs)


def now():
    return call("get_world_properties").sim_time


def run(seconds):
    """Lets the world run for at least `seconds` of its time, and pauses it; returns how long it ran."""
    start = now()
    call("unpause_physics", kind=Empty)
    for _ in range(int(BOUND / 0.005)):
        if now() - start >= seconds:
            break
        rospy.rostime.wallsleep(0.005)
    call("pause_physics", kind=Empty)
    return now() - start


def spawn(name, xml, position=(0.0, 0.0, 0.0)):
    answer = call("spawn_urdf_model", name, xml, "/", Pose(position=Point(*position)), "",
                  kind=SpawnModel)  # fmt: skip
    assert answer.success, answer.status_message


class ServicesTest(unittest.TestCase):
    def setUp(self):
        call("pause_physics", kind=Empty)
        spawn("cartpole", rospy.get_param("/robot_description"))
        spawn("box", BOX, (3.0, 0.0, 20.0))

    def tearDown(self):
        call("pause_physics", kind=Empty)
        for name in ("cartpole", "box"):
            call("delete_model", name)

    def fails(self, text, name, *args, **kwargs):
        answer = call(name, *args, **kwargs)
        self.assertEqual((answer.success, answer.status_message), (False, text))
        return answer

    def succeeds(self, text, name, *args, **kwargs):
        answer = call(name, *args, **kwargs)
        self.assertEqual((answer.status_message, answer.success), (text, True))
        return answer

    def refuses(self, pattern, name, *args, **kwargs):
        answer = call(name, *args, **kwargs)
        self.assertFalse(answer.success)
        self.assertRegex(answer.status_message, pattern)

    def joint(self, name):
        found = call("get_joint_properties", name)
        return found.position[0], found.rate[0]

    def box(self):
        return call("get_model_state", "box", "")

    # models

    def test_model_properties(self):
        found = self.succeeds(
            "GetModelProperties: got properties", "get_model_properties", "cartpole"
        )
        self.assertEqual(found.body_names, ["stand", "cart", "pole"])
        self.assertEqual(found.joint_names, ["grounding", "stand_cart", "cart_pole"])
        self.assertEqual((found.canonical_body_name, found.parent_model_name), ("", ""))
        self.assertEqual((found.child_model_names, found.is_static), ([], False))
        plane = call("get_model_properties", "ground_plane")
        self.assertEqual((plane.geom_names, plane.is_static), (["collision"], True))
        self.assertEqual(call("get_model_properties", "box").geom_names, ["body_collision"])
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
        call("set_model_state", ModelState("cartpole", turned, Twist(), "world"))
        twist = Twist(Vector3(1.0, 0, 0), Vector3(0, 1.0, 0))
        state = ModelState("box", Pose(position=Point(1.0, 0, 5.0)), twist, "cartpole::cart")
        self.assertTrue(call("set_model_state", state).success)
        found = self.box()
        for got, wanted in ((found.pose.position.y, 1.0), (found.pose.position.z, 5.15),
                            (found.twist.linear.y, 1.0), (found.twist.angular.x, -1.0)):  # fmt: skip
            self.assertAlmostEqual(got, wanted, places=6)

    def test_set_model_state_takes_joint_velocities_away(self):
        call("set_model_configuration", "cartpole", "", ["cart_pole"], [0.3])
        run(0.2)
        position, rate = self.joint("cart_pole")
        self.assertNotEqual(rate, 0.0)
        call("set_model_state", ModelState(model_name="cartpole"))
        self.assertEqual(self.joint("cart_pole"), (position, 0.0))

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
            self.wait(lambda p=publisher: p.get_num_connections())
        model.publish(ModelState("nobody", Pose(), Twist(), ""))
        model.publish(ModelState("box", Pose(position=Point(7.0, 0, 9.0)), Twist(), ""))
        self.wait(lambda: self.box().pose.position.x == 7.0)
        link.publish(LinkState("box::body", Pose(position=Point(8.0, 0, 9.0)), Twist(), "map"))
        self.wait(lambda: self.box().pose.position.x == 8.0)

    def wait(self, condition):
        for _ in range(int(BOUND / 0.01)):
            if condition():
                return
            rospy.rostime.wallsleep(0.01)
        self.fail("waited in vain")

    # links

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
        found = call("get_link_properties", "box::body")
        self.assertEqual((found.mass, found.gravity_mode, found.ixy), (4.0, False, 0.01))
        self.assertEqual(found.com, Pose(Point(0.1, 0, 0), Quaternion(0, 0, 0, 1)))
        wrench = Wrench(force=Vector3(8.0, 0, 0))
        call(
            "apply_body_wrench", "box::body", "", Point(), wrench, rospy.Time(), rospy.Duration(-1)
        )
        time = run(0.2)
        found = self.box().twist.linear
        self.assertAlmostEqual(found.x, 8.0 / 4.0 * time, places=2)
        self.assertAlmostEqual(found.z, 0.0, places=6)

    def test_set_link_properties_failures(self):
        text = f"SetLinkProperties: link not found, {SCOPE}"
        self.fails(text, *self.set_box(link_name="nobody", mass=NAN))
        before = call("get_link_properties", "box::body")
        for changes in ({"mass": NAN}, {"mass": 0.0}, {"mass": -2.0}, {"ixx": -1.0}, {"izz": INF},
                        {"ixy": 5.0}, {"com": Pose(position=Point(NAN, 0, 0))}):  # fmt: skip
            self.refuses("SetLinkProperties: .*(mass|izz|position.x)", *self.set_box(**changes))
        self.assertEqual(call("get_link_properties", "box::body"), before)
        self.assertIsInstance(before, GetLinkPropertiesResponse)

    def test_link_state(self):
        answer = self.succeeds(
            "GetLinkState: got state", "get_link_state", "pole", "cartpole::cart"
        )
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
            for got, value in zip(self.joint(name), wanted, strict=True):
                self.assertAlmostEqual(got, value, places=5)

    def test_set_link_state_frames_and_failures(self):
        pose = Pose(position=Point(1.0, 0, 1.0))
        self.assertTrue(call("set_link_state", LinkState("body", pose, Twist(), "stand")).success)
        self.assertEqual(self.box().pose.position, Point(1.0, 0, 1.0))
        self.fails(
            "SetLinkState: link does not exist",
            "set_link_state",
            LinkState("box", pose, Twist(), ""),
        )
        for frame in ("cartpole", "nowhere", "body_collision"):
            self.fails(
                "SetLinkState: failed", "set_link_state", LinkState("body", pose, Twist(), frame)
            )
        twist = Twist(angular=Vector3(y=NAN))
        self.refuses("angular.y is nan", "set_link_state", LinkState("body", pose, twist, ""))

    def test_set_link_state_takes_the_frames_velocity_away(self):
        call("set_link_state", LinkState("cart", Pose(), Twist(linear=Vector3(0.5, 0, 0)), ""))
        call("set_link_state", LinkState("body", Pose(), Twist(), "cart"))
        self.assertAlmostEqual(self.box().twist.linear.x, -0.5, places=6)

    # joints

    def test_set_joint_properties(self):
        text = "SetJointProperties: properties set"
        stops = ODEJointProperties(loStop=[-0.1], hiStop=[0.1, 7.0], erp=[0.3], fudge_factor=[1.0])
        self.succeeds(text, "set_joint_properties", "cartpole::stand_cart", stops)
        call("set_model_configuration", "cartpole", "", ["stand_cart"], [0.4])
        self.assertEqual(self.joint("stand_cart")[0], 0.1)
        self.succeeds(
            text, "set_joint_properties", "cart_pole", ODEJointProperties(damping=[100.0])
        )
        call("set_model_configuration", "cartpole", "", ["cart_pole"], [0.3])
        run(0.1)
        self.assertLess(abs(self.joint("cart_pole")[1]), 0.5)
        self.succeeds(text, "set_joint_properties", "grounding", ODEJointProperties(damping=[1.0]))
        found = call("get_joint_properties", "cart_pole")
        self.assertEqual((found.type, list(found.damping)), (0, []))

    def test_set_joint_properties_failures(self):
        text = "SetJointProperties: joint not found"
        for name in ("elbow", "", "cart"):
            self.fails(text, "set_joint_properties", name, ODEJointProperties())
        for config in (ODEJointProperties(damping=[NAN]), ODEJointProperties(hiStop=[0.1, INF]),
                       ODEJointProperties(damping=[-1.0]), ODEJointProperties(fmax=[-1.0])):  # fmt: skip
            self.refuses("SetJointProperties: .*(damping|hiStop|fmax)",
                         "set_joint_properties", "cart_pole", config)  # fmt: skip

    # forces

    def test_apply_joint_effort(self):
        call("set_physics_properties", physics(gravity=Vector3()))
        text = "ApplyJointEffort: effort set"
        push = ("apply_joint_effort", "cart_pole")
        for duration in (rospy.Duration(0), rospy.Duration(0, 999_999)):
            self.succeeds(text, *push, 1.0, rospy.Time(), duration)
        run(0.02)
        self.assertEqual(self.joint("cart_pole")[1], 0.0)
        self.succeeds(text, *push, 0.1, rospy.Time(), rospy.Duration(0.05))
        start = rospy.Time.from_sec(now() + 1.0)
        self.succeeds(text, *push, 0.1, start, rospy.Duration(-1))
        run(0.1)
        position, rate = self.joint("cart_pole")
        self.assertGreater(rate, 0.1)
        run(0.1)
        self.assertAlmostEqual(self.joint("cart_pole")[1], rate, delta=0.05)
        call("clear_joint_forces", "cartpole::cart_pole", kind=JointRequest)  # matches nothing
        run(1.0)
        self.assertGreater(self.joint("cart_pole")[1], rate + 0.1)
        call("clear_joint_forces", "cart_pole", kind=JointRequest)
        call("reset_simulation", kind=Empty)
        run(0.05)
        self.assertEqual(self.joint("cart_pole"), (0.0, 0.0))
        call("set_physics_properties", physics())

    def test_apply_joint_effort_failures(self):
        late = (rospy.Time(), rospy.Duration(1))
        self.fails("ApplyJointEffort: joint not found", "apply_joint_effort", "elbow", NAN, *late)
        for effort in (NAN, INF, 1e300):
            self.refuses(
                "ApplyJointEffort: effort is", "apply_joint_effort", "cart_pole", effort, *late
            )

    def test_apply_body_wrench(self):
        forever, wrench = rospy.Duration(-1), Wrench(force=Vector3(0, 0, 2.0 * 9.8))
        args = ("box::body", "world", Point(), wrench, rospy.Time(), forever)
        self.succeeds("", "apply_body_wrench", *args)
        run(0.1)
        self.assertAlmostEqual(self.box().twist.linear.z, 0.0, places=4)
        wrench = Wrench(force=Vector3(1.0, 0, 2.0 * 9.8))  # takes the other one's place
        call("apply_body_wrench", "body", "", Point(0, 0, 1), wrench, rospy.Time(), forever)
        time = run(0.1)
        found = self.box().twist
        self.assertAlmostEqual(found.linear.x, 0.5 * time, places=4)
        self.assertAlmostEqual(found.linear.z, 0.0, places=4)
        self.assertAlmostEqual(found.angular.y, 1.0 / 0.1 * time, delta=0.2)
        call("clear_body_wrenches", "body", kind=BodyRequest)  # matches nothing
        call("clear_body_wrenches", "box::body", kind=BodyRequest)
        speed = self.box().twist.linear
        time = run(0.1)
        found = self.box().twist.linear
        self.assertAlmostEqual(found.x, speed.x, places=6)
        self.assertAlmostEqual(found.z, speed.z - 9.8 * time, places=3)

    def test_apply_body_wrench_failures(self):
        rest = (Point(), Wrench(force=Vector3(x=NAN)), rospy.Time(), rospy.Duration(-1))
        self.fails(
            "ApplyBodyWrench: body does not exist", "apply_body_wrench", "box", "nowhere", *rest
        )
        self.fails("ApplyBodyWrench: reference_frame not found",
                   "apply_body_wrench", "body", "nowhere", *rest)  # fmt: skip
        self.refuses(
            "ApplyBodyWrench: wrench.force.x is nan", "apply_body_wrench", "body", "box", *rest
        )

    def test_a_deleted_model_takes_its_forces_along(self):
        wrench = Wrench(force=Vector3(x=5.0))
        call("apply_body_wrench", "body", "", Point(), wrench, rospy.Time(), rospy.Duration(-1))
        call("delete_model", "box")
        spawn("box", BOX, (3.0, 0.0, 20.0))
        run(0.05)
        self.assertEqual(self.box().twist.linear.x, 0.0)

    # physics

    def test_physics_properties(self):
        found = self.succeeds("GetPhysicsProperties: got properties", "get_physics_properties")
        self.assertEqual((found.time_step, found.max_update_rate), (0.001, 1000.0))
        self.assertEqual((found.pause, found.gravity), (True, Vector3(0, 0, -9.8)))
        self.assertEqual(found.ode_config, ode())
        text = "physics engine updated"
        wanted = ode(sor_pgs_iters=77, cfm=0.25, max_contacts=9, auto_disable_bodies=True)
        changed = physics(gravity=Vector3(1.0, 0, 0), time_step=0.002, ode_config=wanted)
        self.succeeds(text, "set_physics_properties", changed)
        time = run(0.1)
        found = call("get_physics_properties")
        self.assertEqual((found.time_step, found.pause, found.ode_config), (0.002, True, wanted))
        self.assertAlmostEqual(self.box().twist.linear.x, time, places=5)
        self.assertEqual(round(now() * 1e9) % 1_000_000, 0)
        self.succeeds(text, "set_physics_properties", physics())

    def test_the_update_rate_acts(self):
        for rate, slowest, fastest in ((200.0, 0.0, 0.4), (0.0, 1.5, 1e9), (-1.0, 1.5, 1e9)):
            call("set_physics_properties", physics(max_update_rate=rate))
            start = now()
            call("unpause_physics", kind=Empty)
            rospy.rostime.wallsleep(0.5)
            call("pause_physics", kind=Empty)
            factor = (now() - start) / 0.5
            self.assertTrue(slowest <= factor <= fastest, f"rate {rate}: {factor}")
        call("set_physics_properties", physics())

    def test_physics_that_no_world_can_have_is_refused(self):
        before = call("get_physics_properties")
        for changes in ({"time_step": 0.0}, {"time_step": -0.001}, {"time_step": NAN},
                        {"time_step": 1e9}, {"time_step": 1e-12}, {"max_update_rate": NAN},
                        {"gravity": Vector3(0, 0, INF)}, {"ode_config": ode(erp=NAN)}):  # fmt: skip
            self.refuses(f"SetPhysicsProperties: .*{next(iter(changes))}",
                         "set_physics_properties", physics(**changes))  # fmt: skip
        self.assertEqual(call("get_physics_properties"), before)

    # dynamic_reconfigure

    def test_reconfigure(self):
        description = rospy.wait_for_message(
            "/gazebo/parameter_descriptions", ConfigDescription, BOUND
        )
        names = [p.name for group in description.groups for p in group.parameters]
        self.assertEqual(len(names), 15)
        self.assertEqual(
            {p.name: p.value for p in description.dflt.doubles}["max_update_rate"], 60.0
        )
        self.assertEqual({p.name: p.value for p in description.max.ints}["sor_pgs_iters"], 10000)
        update = rospy.wait_for_message("/gazebo/parameter_updates", Config, BOUND)
        self.assertEqual({p.name: p.value for p in update.doubles}["time_step"], 0.001)
        wanted = Config(doubles=[DoubleParameter("gravity_z", -1000.0), DoubleParameter("nobody", 1.0)],
                        ints=[IntParameter("max_contacts", 7), IntParameter("time_step", 3)],
                        bools=[BoolParameter("auto_disable_bodies", True)])  # fmt: skip
        answer = call("set_parameters", wanted, kind=Reconfigure).config
        self.assertEqual({p.name: p.value for p in answer.doubles}["gravity_z"], -100.0)  # clamped
        self.assertEqual(len(answer.doubles + answer.ints + answer.bools), 15)
        found = call("get_physics_properties")
        self.assertEqual((found.gravity.z, found.time_step), (-100.0, 0.001))
        self.assertEqual(
            (found.ode_config.max_contacts, found.ode_config.auto_disable_bodies), (7, True)
        )
        self.assertEqual(rospy.get_param("/gazebo/gravity_z"), -100.0)
        update = rospy.wait_for_message("/gazebo/parameter_updates", Config, BOUND)
        self.assertEqual({p.name: p.value for p in update.doubles}["gravity_z"], -100.0)

    def test_reconfigure_takes_back_what_the_service_set(self):
        call("set_physics_properties", physics(gravity=Vector3(3.0, 0, 0)))
        config = Config(doubles=[DoubleParameter("gravity_z", -9.8)], ints=[IntParameter("max_contacts", 20)],
                        bools=[BoolParameter("auto_disable_bodies", False)])  # fmt: skip
        call("set_parameters", config, kind=Reconfigure)
        self.assertEqual(call("get_physics_properties").gravity, Vector3(0, 0, -9.8))

    def test_reconfigure_refuses_what_the_world_cannot_take(self):
        before = call("get_physics_properties")
        for value in (0.0, -3.0, NAN):
            config = Config(doubles=[DoubleParameter("time_step", value)])
            answer = call("set_parameters", config, kind=Reconfigure).config
            self.assertEqual({p.name: p.value for p in answer.doubles}["time_step"], 0.001)
        self.assertEqual(call("get_physics_properties"), before)

    # lights

    def test_lights(self):
        text = "getLightProperties: Requested light lamp not found!"
        self.fails(text, "get_light_properties", "lamp")
        settings = (
            True,
            ColorRGBA(0.1, 0.2, 0.3, 1.0),
            ColorRGBA(),
            0.5,
            0.25,
            0.125,
            Vector3(),
            Pose(),
        )
        text = "setLightProperties: Requested light lamp not found!"
        self.fails(text, "set_light_properties", "lamp", *settings)
        text = 'DeleteLight: Timeout reached while removing light "lamp"'
        self.fails(text, "delete_light", "lamp")
        self.succeeds("", "set_light_properties", "sun", *settings)
        found = self.succeeds("", "get_light_properties", "sun")
        self.assertAlmostEqual(found.diffuse.g, 0.2, places=6)
        self.assertEqual((found.attenuation_constant, found.attenuation_quadratic), (0.5, 0.125))
        bad = (*settings[:3], NAN, *settings[4:])
        self.refuses("attenuation_constant is nan", "set_light_properties", "sun", *bad)
        self.succeeds("DeleteLight: sun successfully deleted", "delete_light", "sun")
        self.assertFalse(call("get_light_properties", "sun").success)


def ode(**changes):
    """ODE's defaults as Gazebo tells them, with some changed."""
    config = ODEPhysics(sor_pgs_iters=50, sor_pgs_w=1.3, erp=0.2, contact_surface_layer=0.001,
                        contact_max_correcting_vel=100.0, max_contacts=20)  # fmt: skip
    for key, value in changes.items():
        setattr(config, key, value)
    return config


def physics(**changes):
    """A request that sets the default physics, with some of it changed."""
    request = SetPhysicsPropertiesRequest(0.001, 1000.0, Vector3(0, 0, -9.8), ode())
    for key, value in changes.items():
        setattr(request, key, value)
    return request


if __name__ == "__main__":
    rospy.init_node("gazebo_services_test")
    rostest.rosrun("cartpole", "gazebo_services", ServicesTest)
