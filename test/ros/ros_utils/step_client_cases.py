"""StepClient against simulators that run, restart, hang, or hold several robots."""

import os
import signal
import time
import unittest

from support.ros.calls import process_of

from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils.service_client import ServiceGone, ServiceHangs
from ros_utils.simulation import Simulation, reserved_port
from ros_utils.step_client import StepClient, StepRefused

CART = "stand_cart_position_controller"
ROBOTS = ("left", "right")


def add_cartpole(name="cartpole", namespace="/", pos_y=0.0):
    assert ros_urdf.urdf_load_from_pkg(
        "cartpole_gazebo", "cartpole_v1.urdf", "robot_description", folder="/robots", ns=namespace
    )
    assert ros_params.ros_load_yaml_from_pkg(
        "cartpole_controller", "joint_position_control.yaml", ns=namespace
    )
    assert ros_gazebo.gazebo_spawn_urdf_param(
        "robot_description", model_name=name, robot_namespace=namespace, pos_y=pos_y
    )[0]
    assert ros_controllers.spawn_controllers_srv([CART], ns=namespace)


def positions(response):
    return dict(zip(response.joint_states.name, response.joint_states.position, strict=True))


class Clients(unittest.TestCase):
    def client(self, **arguments):
        client = StepClient(**arguments)
        self.addCleanup(client.close)
        return client


class OneRobot(Clients):
    """All in one simulator, at time zero."""

    @classmethod
    def setUpClass(cls):
        cls.simulation = Simulation(lockstep=True)
        cls.addClassCleanup(cls.simulation.close)
        cls.enterClassContext(cls.simulation.active())
        add_cartpole()

    def setUp(self):
        self.assertEqual(self.client().reset(everything=True).sim_time, 0.0)

    def test_an_episode(self):
        client = self.client()
        runs = []
        for _ in range(2):
            first = client.reset({"cart_pole": 0.1, "stand_cart": 0.05}, {"cart_pole": -0.5})
            self.assertEqual(first.joint_states.position, (0.1, 0.05))
            self.assertEqual(first.joint_states.velocity, (-0.5, 0.0))
            runs.append([client.step(8, {CART: 0.02 * n}).joint_states.position for n in range(20)])
        self.assertEqual(runs[0], runs[1])
        self.assertEqual(client.reset(everything=True).sim_time, 0.0)
        self.assertEqual(client.step(8, model_states=True).model_names, ["ground_plane", "cartpole"])

    def test_a_simulator_that_hangs_is_an_error_in_time(self):
        client = self.client(timeout=1.0)
        process = process_of(master_uri=self.simulation.master_uri)
        os.kill(process, signal.SIGSTOP)
        self.addCleanup(os.kill, process, signal.SIGCONT)
        with self.assertRaisesRegex(ServiceHangs, r"within 1(\.\d+)? s"):
            client.step(1)

    def test_a_long_step_is_given_its_time(self):
        client = self.client(timeout=0.2)
        begin = time.monotonic()
        self.assertAlmostEqual(client.step(40_000).sim_time, 40.0, places=6)
        self.assertGreater(time.monotonic() - begin, 0.2)


class OwnSimulators(Clients):
    def simulate(self, **arguments):
        simulation = Simulation(lockstep=True, **arguments)
        self.addCleanup(simulation.close)
        return simulation

    def test_several_robots_have_full_names(self):
        with self.simulate().active():
            for place, name in enumerate(ROBOTS):
                add_cartpole(name, f"/{name}", pos_y=float(place))
            client = self.client()
            client.reset({"left::cart_pole": 0.1, "right::cart_pole": -0.1})
            with self.assertRaisesRegex(StepRefused, "several robots have a controller"):
                client.step(8, {CART: 0.1})
            found = positions(client.step(200, {f"/left/{CART}": 0.1, f"/right/{CART}": -0.1}))
            self.assertEqual(len(found), 4)
            self.assertAlmostEqual(found["left::stand_cart"], -found["right::stand_cart"], places=12)
            self.assertGreater(found["left::stand_cart"], 0.05)

    def test_a_restarted_simulator_is_found_again(self):
        """By a reset: the first one after a step that failed, the second one without an error before."""
        port = reserved_port()
        client = None
        for angle in (0.1, 0.2, 0.3):
            simulation = self.simulate(port=port)
            with simulation.active():
                add_cartpole()
                client = client or self.client()
                self.assertEqual(client.reset({"cart_pole": angle}).joint_states.position[0], angle)
                client.step(8, {CART: 0.1})
                simulation.close()
                if angle == 0.1:
                    with self.assertRaises(ServiceGone):
                        client.step(8, {CART: 0.1})
