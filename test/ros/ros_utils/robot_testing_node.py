#!/usr/bin/env python3
"""`RobotTestCase` under rostest: what a test sees of its world, and what a failure says."""

import math
from typing import ClassVar

import rostest

from file_access.locks import scratch_folder
from ros_utils import ros_gazebo
from ros_utils.testing import RobotTestCase, WorldError
from ros_utils.testing.bench import process_bench

CART = "stand_cart_position_controller"
BOX = """<sdf version="1.6"><model name="box"><static>{static}</static><link name="body">
  <inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial>
  <collision name="shell"><geometry><box><size>{size}</size></box></geometry></collision>
</link></model></sdf>"""
CONTROLLERS = f"""
joint_state_controller: {{type: joint_state_controller/JointStateController, publish_rate: 50}}
{CART}:
  type: effort_controllers/JointPositionController
  joint: stand_cart
  pid: {{p: 100.0, d: 10.0}}
"""
SENSORS = "package://cartpole/test/data/sensors/bot.sdf"


class Robots(RobotTestCase):
    seen: ClassVar[list] = []

    def spawn(self, **options):
        self.world.spawn(
            "package://cartpole_gazebo/robots/cartpole_v1.urdf",
            self.file("controllers.yaml", CONTROLLERS),
            ["joint_state_controller", CART],
            **options,
        )

    def spawn_box(self, size, static=False, **options):
        text = BOX.format(size=size, static=str(static).lower())
        self.world.spawn(self.file("box.sdf", text), **options)

    def file(self, name, text):
        path = self.enterContext(scratch_folder()) / name
        path.write_text(text)
        return str(path)

    def test_time_is_exact_and_passes_only_on_request(self):
        self.assertEqual(self.world.time, 0.0)
        self.world.wait(0.123)
        self.world.wait(0.001)
        self.assertEqual(self.world.time, 0.124)
        for wrong in (0.0005, float("nan"), float("inf")):
            with self.assertRaisesRegex(WorldError, f"{wrong} s isn't a number of steps of 1 ms"):
                self.world.wait(wrong)

    def test_time_that_would_never_pass_is_refused(self):
        self.spawn()
        with self.assertRaisesRegex(WorldError, "every 0 s"):
            self.world.command(CART, 0.1, every=0.0)
        self.world.follow("cartpole", "half_way.py", hears="/joint_states", commands=f"/{CART}/command")
        ros_gazebo.gazebo_pause_physics()
        with self.assertRaisesRegex(WorldError, "the world is paused"):
            self.world.wait(1.0)

    def test_a_wrong_name_is_refused_with_its_reason_and_the_world_goes_on(self):
        self.spawn()
        for text, call in (
            ("link.*'pol'.*'pole'", lambda: self.world.link("pol")),
            ("link.*'pol'", lambda: self.world.contacts("pol")),
            ("sensor.*'laser'", lambda: self.world.sensor("laser")),
            ("there is a model 'robot' already", self.spawn),
        ):
            with self.subTest(text), self.assertRaisesRegex(WorldError, text):
                call()
            self.world.wait(0.01)
        for text, controller, values in (
            (f"2 commands where '{CART}' takes 1 .*{CART}: 0.1, 0.2", CART, (0.1, 0.2)),
            ("'stand_cart'", "stand_cart", (0.1,)),
        ):
            self.world.command(controller, *values, every=0.01)
            with self.subTest(text), self.assertRaisesRegex(WorldError, text):
                self.world.wait(0.01)
            self.world.wait(0.1)

    def test_a_spawn_that_fails_says_why(self):
        for text, run, joints in (
            (f"no controller '{CART}s' .*did you mean '{CART}'", f"{CART}s", {}),
            ("'stand_cart' can't start at 45: its stops are -", CART, {"stand_cart": 45.0}),
        ):
            with self.subTest(text), self.assertRaisesRegex(WorldError, text):
                self.world.spawn(
                    "package://cartpole_gazebo/robots/cartpole_v1.urdf",
                    self.file("controllers.yaml", CONTROLLERS),
                    [run],
                    joints=joints,
                )
        self.spawn()

    def test_no_world_has_the_physics_of_the_one_before(self):
        first = ros_gazebo.gazebo_get_physics_properties()
        ros_gazebo.gazebo_set_physics_properties(time_step=0.002, gravity=(0.0, 0.0, -1.0))
        ros_gazebo.gazebo_pause_physics()
        with process_bench().world(seed=1) as world:
            self.assertEqual(ros_gazebo.gazebo_get_physics_properties(), first)
            world.wait(0.001)

    def test_an_assertion_lets_as_much_time_pass_as_it_needs(self):
        self.spawn(joints={"cart_pole": 0.1})
        self.world.assert_joint("cart_pole", 0.1, within=1e-9)
        self.world.command(CART, 0.2)
        self.world.assert_joint("stand_cart", 0.2, within=0.02, by=3.0)
        self.assertLess(0.0, self.world.time)
        self.assertLess(self.world.time, 3.0)
        self.world.assert_joint("stand_cart", 0.2, within=0.04, by=3.0, stays=1.0)
        self.assertLess(1.0, self.world.time)

    def test_a_failure_says_what_was_and_what_was_wanted(self):
        self.spawn()
        text = r"^joint stand_cart is at 0\.\d+ m after 0\.05 s; 2 ± 0\.01 m was wanted$"
        self.world.command(CART, 0.2)
        with self.assertRaisesRegex(AssertionError, text):
            self.world.assert_joint("stand_cart", 2.0, within=0.01, by=0.05)
        self.assertEqual(self.world.time, 0.05)
        with self.assertRaisesRegex(AssertionError, "wanted for 1 s$"):
            self.world.assert_joint("stand_cart", 0.0, within=0.03, stays=1.0)
        with self.assertRaisesRegex(WorldError, r"'stand_car' .*did you mean 'stand_cart'\?"):
            self.world.joint("stand_car")
        with self.assertRaisesRegex(WorldError, "nowhere.urdf can't be spawned"):
            self.world.spawn("/nowhere.urdf", name="other")

    def test_a_box_falls_touches_the_ground_and_stays_there(self):
        self.spawn_box("0.2 0.2 0.2", xyz=(1.0, 2.0, 0.5), rpy=(0.0, 0.0, math.pi / 2))
        self.world.assert_link("body", (1.0, 2.0, 0.5), within=1e-6)
        self.world.assert_touches_nothing("body", stays=0.2)
        self.world.assert_touches("body", "ground_plane", by=0.5)
        self.assertAlmostEqual(self.world.time, math.sqrt(2 * 0.4 / 9.81), delta=0.01)
        self.world.assert_link("body", (None, None, 0.1), within=0.005, by=0.5, stays=1.0)
        with self.assertRaisesRegex(AssertionError, "body touches ground_plane::link::"):
            self.world.assert_touches_nothing("body", by=0.1)

    def test_a_laser_sees_a_wall(self):
        self.world.spawn(SENSORS, name="bot")
        self.world.assert_nearest("scanner", math.inf, within=0.0, by=0.2)
        self.spawn_box("0.1 2 2", static=True, name="wall", xyz=(1.05, 0.0, 0.0))
        self.world.assert_nearest("scanner", 1.0, within=0.05, by=0.2, stays=0.5)
        with self.assertRaisesRegex(AssertionError, r"nearest range of scanner is (1\.0|0\.9)"):
            self.world.assert_nearest("scanner", 2.0, within=0.05, by=0.2)

    def episode(self):
        self.spawn(joints={"cart_pole": 0.05})
        self.world.spawn(SENSORS, name="bot", xyz=(0.0, 1.0, 0.0))
        self.world.follow("cartpole", "half_way.py", hears="/joint_states", commands=f"/{CART}/command")
        self.world.assert_joint("stand_cart", 0.3, within=0.05, by=5.0)
        self.spawn_box("0.1 2 2", static=True, name="wall", xyz=(1.05, 1.0, 0.0))
        self.world.assert_nearest("scanner", 1.0, within=0.1, by=0.2)
        state = self.world.time, self.world.joint("cart_pole"), self.world.sensor("scanner")
        self.seen.append(repr(state))
        self.assertEqual(len(set(self.seen)), 1)

    def test_a_node_that_is_followed_repeats_to_the_bit(self):
        self.episode()

    def test_a_node_that_is_followed_repeats_to_the_bit_once_more(self):
        self.episode()

    def test_a_repeated_command_moves_on_time(self):
        self.spawn()
        self.world.command(CART, 0.1, every=0.1)
        self.world.wait(1.0)
        self.world.command(CART, 0.2)
        self.world.assert_joint("stand_cart", 0.2, within=0.02, by=3.0, stays=0.5)

    def test_a_commands_period_begins_with_it(self):
        """It is sent again at 0.15 s, not at 0.1 s: what moves the joint between them voids the first."""
        self.spawn(name="cart")
        self.world.wait(0.05)
        self.world.command(CART, 0.1, every=0.1)
        self.world.wait(0.07)
        ros_gazebo.gazebo_set_model_configuration("cart", ["stand_cart"], [0.0])
        self.world.wait(0.03)
        self.assertLess(self.world.joint("stand_cart"), 0.001)
        self.world.wait(0.049)
        self.assertGreater(self.world.joint("stand_cart"), 0.005)


if __name__ == "__main__":
    rostest.rosrun("cartpole", "robot_testing", "__main__")
