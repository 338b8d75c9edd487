"""A robot's environment on a page of viser's."""

import math
import time
import urllib.error
import urllib.request

import gymnasium
import pytest
from support.pages.viser_recording import Recording
from support.robots.bodies import ROVER_ROBOT

import cartpole  # noqa: F401 - registers its environments
from robot_envs.pictures.drawn import Camera, RobotPicture
from robot_sim.physics.pose import Pose


def shapes(nodes, kind):
    return [node for node in nodes.values() if node.get("kind") == kind]


def test_the_cart_pole_stands_on_the_page_and_follows_the_environment(server):
    env = gymnasium.make("cartpole/SwingUp-v0", noise=0.0)
    observation, _ = env.reset(seed=0)
    move = env.unwrapped.draw_on(server)
    recording = server.get_scene_serializer()
    for _ in range(15):
        observation, *_ = env.step([1.0])
    recording.insert_sleep(1.0)
    move()
    env.close()
    found = Recording(recording.serialize())
    nodes, before, parts = found.at(), found.parts(0.5), found.parts()
    assert len(parts) == 8  # two rails, four posts, cart, pole
    (ground,) = shapes(nodes, "GridMessage")
    assert ground["infinite_grid"]
    assert shapes(nodes, "DirectionalLightMessage")
    (turned,) = [at for at, was in zip(parts, before, strict=True) if at["wxyz"] != was["wxyz"]]
    assert turned["scale"] == pytest.approx([0.01, 0.01, 0.5])  # the pole
    x, _, z = turned["position"]
    w, _, y, _ = turned["wxyz"]
    up = w * w - y * y
    assert x == pytest.approx(float(observation[0]) + 0.25 * 2.0 * w * y, abs=1e-5)
    assert z - 0.25 * up > 0.5  # the robot of this task stands on a height
    assert (-2.0 * w * y, up) == pytest.approx(tuple(observation[2:4]), abs=1e-5)


def test_the_page_is_seen_as_the_pictures_are(server):
    camera = Camera(target=(0.0, 0.0, 0.1), distance=2.0, yaw=0.0, pitch=0.0, view=30.0)
    picture = RobotPicture(ROVER_ROBOT, camera=camera)
    picture.draw_on(server, lambda: {"neck": 0.0})
    page = server.initial_camera
    assert page.position.tolist() == pytest.approx([0.0, -2.0, 0.1])
    assert page.look_at.tolist() == pytest.approx([0.0, 0.0, 0.1])
    assert math.degrees(page.fov) == pytest.approx(30.0)


def test_the_world_goes_by_a_robot_that_drives_away(server):
    """So whoever looks at it goes on looking at it."""
    place = [Pose((0.0, 0.0, 0.1))]
    picture = RobotPicture(ROVER_ROBOT, base=lambda: place[0])
    robot = picture.draw_on(server, lambda: {"neck": 0.0})
    recording = server.get_scene_serializer()
    place[0] = Pose((7.0, -2.0, 0.1))
    robot()
    found = Recording(recording.serialize())
    hull, mast = found.parts()
    assert hull["position"] == pytest.approx([7.0, -2.0, 0.1])  # in the world
    assert mast["position"] == pytest.approx([7.0, -2.0, 0.3])
    assert found.at()["/world"]["position"] == pytest.approx([-7.0, 2.0, -0.1])


def test_a_switch_lets_the_robot_drive_out_of_sight_and_goes_with_its_environment(server):
    place = [Pose((0.0, 0.0, 0.1))]
    picture = RobotPicture(ROVER_ROBOT, base=lambda: place[0])
    robot = picture.draw_on(server, lambda: {"neck": 0.0})
    place[0] = Pose((7.0, -2.0, 0.1))
    robot()
    (switch,) = switches(server)
    for follows, where in ((False, [0.0, 0.0, 0.0]), (True, [-7.0, 2.0, -0.1])):
        switch.value = follows
        nodes = Recording(server.get_scene_serializer().serialize()).at()
        assert nodes["/world"]["position"] == pytest.approx(where)
    picture.close()
    assert not switches(server)
    picture.draw_on(server, lambda: {"neck": 0.0})
    still = RobotPicture(ROVER_ROBOT, camera=Camera(follows=False))
    still.draw_on(server, lambda: {"neck": 0.0})
    assert [each.value for each in switches(server)] == [True, False]


def switches(server):
    found = server.gui._gui_input_handle_from_uuid.values()
    return [each for each in list(found) if each.label == "Follow"]


def test_the_render_mode_human_shows_the_robot_on_a_page_in_real_time(capsys):
    env = gymnasium.make("cartpole/Classic-v0", render_mode="human")
    assert env.metadata["render_modes"] == ["human", "rgb_array"]
    begin = time.monotonic()
    for _ in range(2):
        env.reset(seed=0)
        for _ in range(10):
            env.step(1)
    assert time.monotonic() - begin >= 20 * 0.008
    assert env.render() is None
    (line,) = capsys.readouterr().out.splitlines()
    address = line.removeprefix("the robot is shown on the page ")
    with urllib.request.urlopen(address) as opened:
        assert opened.status == 200
    env.close()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(address)
