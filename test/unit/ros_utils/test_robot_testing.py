"""`ros_utils.testing` with pytest and unittest: what a user sees of passing, failing and wavering tests."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rosbag
from PIL import Image
from support.ros.calls import executable

from ros_utils.testing.bench import failure_folder

pytestmark = pytest.mark.slow

LIMIT = 300.0  # [s] for a process
ROBOT = """
CART = "stand_cart_position_controller"

def spawn(world):
    world.spawn(
        "package://cartpole_gazebo/robots/cartpole_v1.urdf",
        "package://cartpole_controller/config/joint_position_control.yaml",
        ["joint_state_controller", CART],
    )
    world.command(CART, 0.3)
"""
FAILING = f"""
{ROBOT}
import pytest
pytest_plugins = ["ros_utils.testing.pytest_plugin"]
runs = []

@pytest.fixture
def world_seed():
    return 7

def test_it_gets_there(world):
    spawn(world)
    world.assert_joint("stand_cart", 0.2, within=0.02, by=1.0, stays=1.0)

def test_wavers(world):
    world.wait(0.1)
    runs.append(None)
    assert len(runs) == 2

def test_names_an_object(world):
    assert world is None
"""
PASSING = f"""
{ROBOT}
import os
pytest_plugins = ["ros_utils.testing.pytest_plugin"]

def test_it_gets_there(world):
    spawn(world)
    world.assert_joint("stand_cart", 0.3, within=0.02, by=3.0, stays=1.0)
    with open(os.environ["PLACES"], "a") as file:
        print(os.environ["ROS_MASTER_URI"], world.time, world.joint("cart_pole"), file=file)

test_once_more = test_it_gets_there
"""
CASE = f"""
{ROBOT}
import unittest
from ros_utils.testing import RobotTestCase

class Cart(RobotTestCase):
    def test_it_gets_there(self):
        spawn(self.world)
        self.world.follow("cartpole", "half_way.py", hears="/joint_states", commands=f"/{{CART}}/command")
        self.world.assert_joint("stand_cart", 0.2, within=0.02, by=1.0, stays=1.0)

    def test_a_file_is_there(self):
        open("/nowhere")

    def test_in_parts(self):
        for place in (0.0, 1.0):
            with self.subTest(place=place):
                self.world.wait(0.1)
                self.assertEqual(self.world.time, place)
        raise ValueError("another fault")

    def tearDown(self):
        print("torn down")

class OtherCart(Cart):
    test_a_file_is_there = test_in_parts = None

unittest.main()
"""
FOLLOWING = f"""
{ROBOT}
pytest_plugins = ["ros_utils.testing.pytest_plugin"]

def test_it_follows(world):
    spawn(world)
    world.follow("cartpole", "half_way.py", hears="/joint_states", commands=f"/{{CART}}/command")
    world.assert_joint("stand_cart", 0.1, within=0.001, by=0.5, stays=1.0)
"""


def run(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "ROS_MASTER_URI": "http://127.0.0.1:9", "ROS_HOME": str(folder)}
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env={**environment, **variables}, timeout=LIMIT,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip


def test_a_failure_leaves_its_recording_and_seed(tmp_path):
    (tmp_path / "test_cart.py").write_text(FAILING)
    place = tmp_path / "failures"
    done = run(
        tmp_path, "-m", "pytest", "test_cart.py", ROS_TEST_FAILURES=str(place), CARTPOLE_WITH="/a b:/c"
    )
    assert "3 failed" in done.stdout
    assert done.stdout.count("isn't repeatable") == 1
    assert "rad after" not in done.stdout and "m after" in done.stdout
    folder = place / "test_cart.py-test_it_gets_there"
    assert f"recorded in {folder}" in done.stdout
    assert "0.2 ± 0.02 m was wanted" in (folder / "failure.txt").read_text()
    assert "seed: 7" in (folder / "failure.txt").read_text()
    with Image.open(folder / "world.png") as picture:
        assert len(np.unique(np.asarray(picture).reshape(-1, 3), axis=0)) > 20
    with rosbag.Bag(str(folder / "world.bag")) as bag:
        seen = [message.position for _, message, _ in bag.read_messages("/joint_states")]
        assert min(seen) != max(seen) and 0.9 < bag.get_end_time() < 2.1
    line = f"--with '/a b' --with /c rosrun cartpole replay.py {folder / 'world.bag'}"
    told = (folder / "failure.txt").read_text()
    assert f"replayed by: ./ws {line}\n" in told and f": ./ws {line} --gui\n" in told
    replay = executable("cartpole", "replay.py")
    again = run(tmp_path, replay, str(folder / "world.bag"))
    assert again.returncode == 0 and "equal to the bit" in again.stdout, again.stdout
    wavers = place / "test_cart.py-test_wavers"
    assert f"it isn't repeatable; that run is recorded in {wavers}" in done.stdout


def test_each_failure_has_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_TEST_FAILURES", str(tmp_path))
    tests = [f"test/test_cart.py::test_sorts[{sign}]" for sign in "<>"]
    plain, *others = (failure_folder(test) for test in (tests[0].partition("[")[0], *tests))
    assert plain == tmp_path / "test-test_cart.py-test_sorts"
    assert {plain, *others} == set(tmp_path.iterdir()) and others[0] != others[1]


def test_the_last_test_of_a_session_is_recorded_with_its_nodes(tmp_path):
    (tmp_path / "test_cart.py").write_text(FOLLOWING)
    done = run(tmp_path, "-m", "pytest", "test_cart.py")
    folder = tmp_path / "test_failures/test_cart.py-test_it_follows"
    assert f"\nrecorded in {folder}\n" in done.stdout, done.stdout  # the second run fails alike


def test_a_failure_is_told_though_it_cant_be_recorded(tmp_path):
    (tmp_path / "test_cart.py").write_text(FAILING)
    (tmp_path / "file").touch()
    place = str(tmp_path / "file/failures")
    done = run(tmp_path, "-m", "pytest", "-k", "gets_there", "test_cart.py", ROS_TEST_FAILURES=place)
    assert "0.2 ± 0.02 m was wanted" in done.stdout and "1 failed" in done.stdout, done.stdout
    assert f"not recorded: [Errno 20] Not a directory: '{place}" in done.stdout


def test_files_in_parallel_have_simulators_of_their_own_and_the_same_bits(tmp_path):
    for name in ("a", "b"):
        (tmp_path / f"test_{name}.py").write_text(PASSING)
    words = ("-m", "pytest", "--numprocesses", "2", "--dist", "loadfile")
    done = run(tmp_path, *words, PLACES=str(tmp_path / "places"))
    assert "4 passed" in done.stdout, done.stdout
    lines = [line.split() for line in (tmp_path / "places").read_text().splitlines()]
    masters, *results = (set(column) for column in zip(*lines, strict=True))
    assert len(masters) == 2 and [len(each) for each in results] == [1, 1]


def test_with_unittest_a_failure_says_where_its_recording_is(tmp_path):
    (tmp_path / "cart.py").write_text(CASE)
    done = run(tmp_path, "cart.py")
    folder = tmp_path / "test_failures/__main__.Cart.test_it_gets_there"
    assert done.returncode == 1 and f"recorded in {folder}" in done.stdout, done.stdout
    assert done.stdout.count("\nrecorded in ") == 4  # the second run fails alike
    parts = folder.with_name("__main__.Cart.test_in_parts")
    assert f"\nrecorded in {parts}\n" in done.stdout and "(place=1.0)" in done.stdout
    assert "0.1 != 0.0" in (parts / "failure.txt").read_text()
    assert "self.world.assert_joint(" in done.stdout and "robot_world.py" not in done.stdout
    assert done.stdout.count("torn down") == 8
    left = {path.name for path in folder.iterdir()}
    assert left == {"failure.txt", "simulator.log", "world.bag", "world.png"}
