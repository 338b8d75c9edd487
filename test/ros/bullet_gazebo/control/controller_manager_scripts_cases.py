"""The programs controller_manager and controller_group: printed lines and exit codes.

The world is paused throughout. Lines are those that ros_control's own tests expect of its scripts. Most
commands run in this process, which saves half a second each.
"""

import contextlib
import io
import os
import socket
import subprocess
from unittest import mock

import rospy
from controller_client import CONTROLLERS, PausedRobot
from controller_manager import controller_manager_interface as interface
from support.ros.calls import BOUND, delete_model, executable
from support.ros.manager import STRICT

from bullet_gazebo.clients.manager_commands import group_main
from bullet_gazebo.clients.manager_commands import main as manager_main

GROUPS = {"upper": ["pole"], "lower": ["cart", "pole"], "other": ["cart2", "pole"], "empty": []}
COMMANDS = "bullet_gazebo.clients.manager_commands"
NONE = "No controllers are loaded in mechanism control\n"


def listed(name, state):
    return f"'{name}' - 'hardware_interface::EffortJointInterface' ( {state} )\n"


class ScriptsTest(PausedRobot):
    def setUp(self):
        super().setUp()
        rospy.set_param("/controller_groups", GROUPS)

    def run_script(self, script, *arguments, **environment):
        """Exit code, output and errors of the program itself."""
        done = subprocess.run(
            [executable("controller_manager", script), *arguments],
            capture_output=True, text=True, env=os.environ | environment, timeout=BOUND, check=False,
        )  # fmt: skip
        return done.returncode, done.stdout, done.stderr

    def run_here(self, command):
        """The same of a command line of controller_manager, or of the script that it begins with."""
        words = command.split()
        grouped = words[0] == "controller_group"
        main = group_main if grouped else manager_main
        output, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            code = main(words if grouped else ["controller_manager", *words])
        return code, output.getvalue(), errors.getvalue()

    def expect(self, command, expected):
        self.assertEqual(self.run_here(command)[:2], (0, expected), command)

    # controller_manager

    def test_one_controller_from_load_to_unload(self):
        self.expect("list", NONE)
        self.expect("load cart", "Loaded 'cart'\n")
        self.expect("start cart", "Started ['cart'] successfully\n")
        self.expect("lc", listed("cart", "running"))
        self.expect("unload cart", "Error when unloading 'cart'\n")
        self.expect("stop cart", "Stopped ['cart'] successfully\n")
        self.expect("unload cart", "Unloaded 'cart' successfully\n")

    def test_several_controllers(self):
        self.expect("spawn states pole", "Loaded 'states'\nLoaded 'pole'\n"
                    "Started ['states'] successfully\nStarted ['pole'] successfully\n")  # fmt: skip
        self.expect("list", "'states' - 'hardware_interface::JointStateInterface' ( running )\n"
                    + listed("pole", "running"))  # fmt: skip
        self.expect("kill pole states", "Stopped ['pole'] successfully\nStopped ['states'] successfully\n"
                    "Unloaded 'pole' successfully\nUnloaded 'states' successfully\n")  # fmt: skip

    def test_what_the_manager_refuses_is_printed_and_no_failure(self):
        self.expect("unload nobody", "Error when unloading 'nobody'\n")
        self.expect("spawn nobody cart", "Error when loading 'nobody'\nLoaded 'cart'\n"
                    "Error when starting ['nobody']\nStarted ['cart'] successfully\n")  # fmt: skip

    def test_reload(self):
        self.expect("spawn cart", "Loaded 'cart'\nStarted ['cart'] successfully\n")
        self.expect("reload-libraries --restore", "Restore: True\nSuccessfully reloaded libraries\n"
                    "Controllers restored to original state\n")  # fmt: skip
        self.assertEqual(self.manager.states(), {"cart": "running"})
        self.expect("reload-libraries", "Restore: False\nSuccessfully reloaded libraries\n")
        self.assertEqual(self.manager.states(), {})

    def test_in_a_namespace(self):
        delete_model()
        self.spawn_cartpole(robot_namespace="/my_robot")
        rospy.set_param("/my_robot/cart", CONTROLLERS["cart"])
        code, output, _ = self.run_script("controller_manager", "load", "cart", "__ns:=/my_robot")
        self.assertEqual((code, output), (0, "Loaded 'cart'\n"))
        code, output, _ = self.run_script("controller_manager", "list", ROS_NAMESPACE="/my_robot")
        self.assertEqual((code, output), (0, listed("cart", "initialized")))

    def test_without_a_manager_they_say_so(self):
        delete_model()
        name = "/controller_manager/reload_controller_libraries"
        patience = {"MANAGER_PATIENCE": 0.5, "NOTICE": 0.1}
        for command in ("list", "load cart"):
            with mock.patch.multiple(COMMANDS, **patience):
                code, _, errors = self.run_here(command)
            waiting, gone = errors.splitlines()
            self.assertEqual((code, waiting), (1, f"waiting up to 0.5 s for the service {name}"))
            self.assertIn(f"there is no controller manager: no node offers the service {name}", gone)

    def test_without_a_master_they_say_so(self):
        with socket.socket() as reserved:  # bound, and nobody listens
            reserved.bind(("127.0.0.1", 0))
            master = f"http://127.0.0.1:{reserved.getsockname()[1]}"
            for script in ("controller_manager", "controller_group"):
                found = self.run_script(script, "list", ROS_MASTER_URI=master)
                self.assertEqual(found, (1, "", f"{script}: there is no ROS master at {master}\n"))

    # controller_group

    def test_groups_are_listed(self):
        self.expect("controller_group list", "Number of groups: 4\n  empty\n"
                    "  lower\n      cart\n      pole\n  other\n      cart2\n      pole\n"
                    "  upper\n      pole\n")  # fmt: skip

    def test_a_group_is_spawned_and_switched(self):
        self.expect("spawn states", "Loaded 'states'\nStarted ['states'] successfully\n")
        self.expect("controller_group spawn lower", "Loaded 'cart'\nLoaded 'pole'\n"
                    "Started ['cart'] successfully\nStarted ['pole'] successfully\n")  # fmt: skip
        self.expect("controller_group switch other", "Loaded 'cart2'\n"
                    "Started ['cart2'] successfully\nStopped ['cart'] successfully\n")  # fmt: skip
        self.expect("controller_group switch other", "")
        self.expect("controller_group switch empty", "Stopped ['pole', 'cart2'] successfully\n")
        self.assertEqual(
            self.manager.states(),
            {"states": "running", "cart": "stopped", "pole": "stopped", "cart2": "stopped"},
        )
        self.expect("controller_group spawn upper",
                    "Error when loading 'pole'\nStarted ['pole'] successfully\n")  # fmt: skip

    def test_a_group_that_conflicts_is_not_switched_to(self):
        rospy.set_param("/controller_groups/faulty", ["cart", "cart2"])
        self.expect("controller_group spawn other", "Loaded 'cart2'\nLoaded 'pole'\n"
                    "Started ['cart2'] successfully\nStarted ['pole'] successfully\n")  # fmt: skip
        self.expect("controller_group switch faulty", "Loaded 'cart'\n"
                    "Error when starting ['cart'] and stopping ['pole']\n")  # fmt: skip
        self.assertEqual(
            self.manager.states(), {"cart2": "running", "pole": "running", "cart": "initialized"}
        )

    def test_groups_that_are_none(self):
        place = "controller_group: the parameter /controller_groups"
        for groups, text in (
            ("lower", " must map names of groups to lists of controllers"),
            ({"lower": [1]}, ": group 'lower' must be a list of names of controllers"),
        ):
            rospy.set_param("/controller_groups", groups)
            found = self.run_here("controller_group spawn lower")
            self.assertEqual(found, (1, "", f"{place}{text}\n"))
        rospy.delete_param("/controller_groups")
        found = self.run_here("controller_group list")
        self.assertEqual(found, (1, "", f"{place} isn't set\n"))

    def test_an_unknown_group(self):
        code, output, errors = self.run_here("controller_group switch nobody")
        self.assertEqual((code, output), (1, ""))
        self.assertIn("no group 'nobody' in /controller_groups: ['empty', 'lower', 'other', 'upper']", errors)

    # the Python module

    def test_the_module_returns_what_it_prints(self):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            returned = [
                interface.load_controller("nobody"),
                interface.load_controller("cart"),
                interface.load_controller("pole"),
                interface.start_controller("cart"),
                interface.stop_controller("cart"),
                interface.start_controllers(["cart", "pole"]),
                interface.stop_controller("states"),
                interface.reload_libraries(False),
                interface.stop_controllers(["cart", "pole"]),
                interface.unload_controller("cart"),
                interface.reload_libraries(True, restore=True),
            ]
            interface.list_controllers()
            interface.list_controller_types()
        self.assertEqual(returned, [False, True, True, True, True, True, False, False, True, True, True])
        expected = (
            "Error when loading 'nobody'\nLoaded 'cart'\nLoaded 'pole'\n"
            "Started ['cart'] successfully\nStopped ['cart'] successfully\n"
            "Started ['cart', 'pole'] successfully\nError when stopping ['states']\n"
            "Restore: False\nFailed to reload libraries. Do you still have controllers loaded?\n"
            "Stopped ['cart', 'pole'] successfully\nUnloaded 'cart' successfully\n"
            "Restore: True\nSuccessfully reloaded libraries\nControllers restored to original state\n"
        ) + listed("pole", "initialized")
        self.assertTrue(printed.getvalue().startswith(expected), printed.getvalue())
        self.assertTrue(printed.getvalue().endswith(f"{self.manager.types().types[-1]}\n"))
        self.assertTrue(self.manager.switch(["pole"], [], STRICT))
