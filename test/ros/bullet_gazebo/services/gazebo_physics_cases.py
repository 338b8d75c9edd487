"""Physics properties, dynamic_reconfigure, lights and loggers."""

import time

import rospy
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, IntParameter
from dynamic_reconfigure.srv import Reconfigure
from gazebo_world import INF, NAN, GazeboTest, ode, physics, run
from geometry_msgs.msg import Pose, Vector3
from roscpp.srv import GetLoggers, SetLoggerLevel
from std_msgs.msg import ColorRGBA
from support.ros.calls import BOUND, call, gazebo, sim_time, wait_until

PARAMETERS = {  # type, default, least, most
    "time_step": ("double", 0.001, 0.0, 10.0),
    "max_update_rate": ("double", 60.0, 0.0, 1000.0),
    "gravity_x": ("double", 0.0, -100.0, 100.0),
    "gravity_y": ("double", 0.0, -100.0, 100.0),
    "gravity_z": ("double", -9.8, -100.0, 100.0),
    "auto_disable_bodies": ("bool", False, False, True),
    "sor_pgs_precon_iters": ("int", 0, 0, 10000),
    "sor_pgs_iters": ("int", 20, 0, 10000),
    "sor_pgs_w": ("double", 1.3, 0.0, 5.0),
    "sor_pgs_rms_error_tol": ("double", -1.0, -1.0, 10000.0),
    "cfm": ("double", 0.0, 0.0, 10.0),
    "erp": ("double", 0.2, 0.0, 10.0),
    "contact_surface_layer": ("double", 0.001, 0.0, 10.0),
    "contact_max_correcting_vel": ("double", 100.0, 0.0, 10000000.0),
    "max_contacts": ("int", 100, 0, 10000000),
}


class PhysicsTest(GazeboTest):
    def test_physics_properties(self):
        found = self.succeeds("GetPhysicsProperties: got properties", "get_physics_properties")
        self.assertEqual((found.time_step, found.max_update_rate), (0.001, 1000.0))
        self.assertEqual((found.pause, found.gravity), (True, Vector3(0, 0, -9.8)))
        self.assertEqual(found.ode_config, ode())
        text = "physics engine updated"
        wanted = ode(sor_pgs_iters=77, cfm=0.25, max_contacts=9, auto_disable_bodies=True)
        changed = physics(gravity=Vector3(1.0, 0, 0), time_step=0.002, ode_config=wanted)
        self.succeeds(text, "set_physics_properties", changed)
        passed = run(0.1)
        found = gazebo("get_physics_properties")
        self.assertEqual((found.time_step, found.pause, found.ode_config), (0.002, True, wanted))
        self.assertAlmostEqual(self.box().twist.linear.x, passed, places=5)
        self.assertEqual(round(sim_time() * 1e9) % 1_000_000, 0)
        self.succeeds(text, "set_physics_properties", physics())

    def test_the_update_rate_acts(self):
        # Steps of 10 ms, so that a busy machine, too, is well beyond real time where nothing holds it.
        slow, free = (20.0, 0.0, 0.4), [(rate, 1.5, INF) for rate in (0.0, -1.0)]
        for rate, slowest, fastest in (slow, free[0], slow, free[1]):
            gazebo("set_physics_properties", physics(time_step=0.01, max_update_rate=rate))
            start, begin = sim_time(), time.monotonic()
            gazebo("unpause_physics")
            rospy.rostime.wallsleep(0.5)
            gazebo("pause_physics")
            factor = (sim_time() - start) / (time.monotonic() - begin)
            self.assertTrue(slowest <= factor <= fastest, f"rate {rate}: {factor}")
        gazebo("set_physics_properties", physics())

    def test_physics_that_no_world_can_have_is_refused(self):
        before = gazebo("get_physics_properties")
        for changes in ({"time_step": 0.0}, {"time_step": -0.001}, {"time_step": NAN},
                        {"time_step": 1e9}, {"time_step": 1e-12}, {"max_update_rate": NAN},
                        {"gravity": Vector3(0, 0, INF)}, {"ode_config": ode(erp=NAN)}):  # fmt: skip
            self.refuses(f"SetPhysicsProperties: .*{next(iter(changes))}",
                         "set_physics_properties", physics(**changes))  # fmt: skip
        self.assertEqual(gazebo("get_physics_properties"), before)

    def test_reconfigure(self):
        update = rospy.wait_for_message("/gazebo/parameter_updates", Config, BOUND)
        self.assertEqual({p.name: p.value for p in update.doubles}["time_step"], 0.001)
        wanted = Config(doubles=[DoubleParameter("gravity_z", -1000.0), DoubleParameter("nobody", 1.0)],
                        ints=[IntParameter("max_contacts", 7), IntParameter("time_step", 3)],
                        bools=[BoolParameter("auto_disable_bodies", True)])  # fmt: skip
        answer = call("/gazebo/set_parameters", Reconfigure, wanted).config
        self.assertEqual({p.name: p.value for p in answer.doubles}["gravity_z"], -100.0)  # clamped
        self.assertEqual(len(answer.doubles + answer.ints + answer.bools), 15)
        found = gazebo("get_physics_properties")
        self.assertEqual((found.gravity.z, found.time_step), (-100.0, 0.001))
        self.assertEqual((found.ode_config.max_contacts, found.ode_config.auto_disable_bodies), (7, True))
        self.assertEqual(rospy.get_param("/gazebo/gravity_z"), -100.0)
        update = rospy.wait_for_message("/gazebo/parameter_updates", Config, BOUND)
        self.assertEqual({p.name: p.value for p in update.doubles}["gravity_z"], -100.0)

    def test_reconfigure_takes_back_what_the_service_set(self):
        gazebo("set_physics_properties", physics(gravity=Vector3(3.0, 0, 0)))
        config = Config(doubles=[DoubleParameter("gravity_z", -9.8)], ints=[IntParameter("max_contacts", 20)],
                        bools=[BoolParameter("auto_disable_bodies", False)])  # fmt: skip
        call("/gazebo/set_parameters", Reconfigure, config)
        self.assertEqual(gazebo("get_physics_properties").gravity, Vector3(0, 0, -9.8))

    def test_reconfigure_refuses_what_the_world_cannot_take(self):
        before = gazebo("get_physics_properties")
        for value in (0.0, -3.0, NAN):
            config = Config(doubles=[DoubleParameter("time_step", value)])
            answer = call("/gazebo/set_parameters", Reconfigure, config).config
            self.assertEqual({p.name: p.value for p in answer.doubles}["time_step"], 0.001)
        self.assertEqual(gazebo("get_physics_properties"), before)

    def test_lights(self):
        text = "getLightProperties: Requested light lamp not found!"
        self.fails(text, "get_light_properties", "lamp")
        colours = ColorRGBA(0.1, 0.2, 0.3, 1.0), ColorRGBA()
        settings = (True, *colours, 0.5, 0.25, 0.125, Vector3(), Pose())
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
        self.assertFalse(gazebo("get_light_properties", "sun").success)

    def test_the_parameters_are_described_as_gazebo_describes_them(self):
        client = Client("/gazebo", timeout=BOUND)
        self.addCleanup(client.close)
        self.assertTrue(wait_until(lambda: client.get_group_descriptions() is not None))
        described = {p["name"]: (p["type"], p["default"], p["min"], p["max"])
                     for p in client.get_parameter_descriptions()}  # fmt: skip
        self.assertEqual(described, PARAMETERS)
        # The first values are the world's, not the defaults.
        first = {"max_update_rate": 1000.0, "sor_pgs_iters": 50, "sor_pgs_rms_error_tol": 0.0}
        for name, value in first.items():
            self.assertEqual(rospy.get_param(f"/gazebo/{name}"), value)
        found = client.update_configuration({"sor_pgs_iters": 60, "cfm": 0.5})
        self.assertEqual((found["sor_pgs_iters"], found["cfm"]), (60, 0.5))
        config = gazebo("get_physics_properties").ode_config
        self.assertEqual((config.sor_pgs_iters, config.cfm), (60, 0.5))
        client.update_configuration({"sor_pgs_iters": 50, "cfm": 0.0})

    # loggers

    def test_loggers(self):
        for level in ("debug", "warn", "info"):
            call("/gazebo/set_logger_level", SetLoggerLevel, "rosout", level)
            loggers = call("/gazebo/get_loggers", GetLoggers).loggers
            levels = {each.name: each.level for each in loggers}
            self.assertEqual(levels["rosout"].lower()[:4], level[:4])
