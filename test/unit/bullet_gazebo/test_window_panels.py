"""The window's panels on a real page, without a simulator and without a browser."""

import sys
import threading
from importlib.metadata import version
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
import viser
from support.pages.browser import Browser, find_browser, wait_for
from websockets.sync.client import connect

from bullet_gazebo.window import window
from bullet_gazebo.window.model_panel import NONE, ModelPanel
from bullet_gazebo.window.panels import ONLY_STEPS, TimePanel
from bullet_gazebo.window.window import Window
from robot_sim.physics.description import Joint, Link
from robot_sim.physics.files.elements import shown
from robot_sim.pictures.page import Picture
from robot_sim.pictures.visuals import VisibleModel

ROUNDS = 300
SWITCH = 1e-5  # [s] after which another thread has its turn
JOINTS = {"one": 3, "many": 20}  # of each model


@pytest.fixture
def interleaved():
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH)
    yield
    sys.setswitchinterval(before)


class NoControllers:
    def holder(self, joint):
        return f"nobody holds {joint}"


def handles(server, kind):
    """What is on the page of that kind, by label."""
    found = server.gui._gui_input_handle_from_uuid.values()
    return {each.label: each for each in list(found) if isinstance(each, kind)}


def joint(name):
    return Joint(name, "revolute", "", "base", axis=(0.0, 0.0, 1.0), lower=-1.0, upper=1.0)


def panel_of(server, stands=True, controllers=None, act=None):
    """A panel of models, whose time may stand still."""
    world, controllers = server.scene.add_frame("/world"), controllers or NoControllers()
    return ModelPanel(server, world, None, controllers, act, lambda: stands)


def at_rest(count=1):
    """Poses of links."""
    return np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]] * count)


def test_models_are_chosen_while_another_thread_shows_them(server, interleaved):
    """Time that runs and stands by turns switches sliders off and on, which removed ones refuse."""
    stands = False
    world = server.scene.add_frame("/world")
    panel = ModelPanel(server, world, None, NoControllers(), None, lambda: stands)
    picture = Picture(server, pytest.fail)
    names = {name: [f"{name}_{i}" for i in range(count)] for name, count in JOINTS.items()}
    drawn = [
        VisibleModel(number, name, [Link("base")], list(map(joint, names[name])))
        for number, name in enumerate(names)
    ]
    picture.draw(drawn, [])
    picture.move(at_rest(len(names)))
    models = list(picture.models.values())
    panel.set_models(models)
    choice = handles(server, viser.GuiDropdownHandle)["Model"]
    shown = threading.Semaphore(0)

    def choose():
        for _ in range(ROUNDS):
            for name in [*names, NONE]:
                choice.value = name
                shown.acquire(timeout=0.1)  # a showing that begins before the next click

    clicks = threading.Thread(target=choose, daemon=True)
    clicks.start()
    while clicks.is_alive():
        stands = not stands
        at = 1.0 if stands else -1.0
        shown.release()
        panel.show(picture.links, {name: dict.fromkeys(each, at) for name, each in names.items()})
        if stands:
            panel.set_models(models)
    for name in [*names, NONE]:
        choice.value = name
        panel.show(picture.links, {})
        assert sorted(handles(server, viser.GuiSliderHandle)) == sorted(names.get(name, []))


def test_the_only_one_that_moves_is_followed_unless_another_is_chosen(server):
    panel = panel_of(server)
    world = panel._world
    fixed = VisibleModel(1, "ground", [Link("base")], static=True)
    models = [fixed, VisibleModel(2, "walker", [Link("base")])]
    switch = handles(server, viser.GuiCheckboxHandle)["Follow"]

    def seen(place):
        panel.set_models(models)
        poses = {each.name: at_rest() for each in models}
        if "walker" in poses:
            poses["walker"][0, 0] = place
        panel.follow(poses)
        return float(world.position[0])

    assert [seen(1.0), seen(3.0), seen(-4.0)] == [0.0, -2.0, 5.0]
    switch.value = False
    assert seen(3.0) == 0.0
    switch.value = True
    models.append(VisibleModel(3, "other", [Link("base")]))
    assert [seen(1.0), seen(3.0)] == [0.0, 0.0]  # which of them?
    handles(server, viser.GuiDropdownHandle)["Model"].value = "walker"
    assert [seen(1.0), seen(3.0)] == [0.0, -2.0]
    del models[1:]
    assert seen(1.0) == 0.0


HURT = "window.hurt = 1"
NAMES = (
    f"<img src=x onerror='{HURT}'>",
    f'"><script>{HURT}</script>',
    f"[a link](javascript:{HURT})",
    "99999999999999999999",
    "né 机器人 🤖 \u202e right",
    "a\nb\tc",
)


@pytest.mark.slow
@pytest.mark.skipif(not find_browser(), reason="no Chromium: apt-get install chromium")
def test_foreign_names_and_numbers_are_only_text_to_a_browser(server):
    """As names of models and joints, as options, labels, captions and faults; as stops of joints."""
    limits = (1.0, 1e14, 99999999999999999999.0, 1e-300, 1e308, -1.0)
    joints = [
        Joint(f"{name} joint", "revolute", "", "base", lower=-limit, upper=limit)
        for name, limit in zip(NAMES, limits, strict=True)
    ]
    models = [VisibleModel(place, name, [Link("base")], joints) for place, name in enumerate(NAMES)]
    panel = panel_of(server, stands=False)
    picture = Picture(server, lambda line: None)
    picture.draw(models, [], joint_frames=True)
    picture.move(at_rest(len(models)))
    panel.set_models(models)
    handles(server, viser.GuiDropdownHandle)["Model"].value = NAMES[0]
    at = (1e300, 0.0, -1e20, float("nan"), 1e308, 0.0)
    positions = dict.fromkeys(NAMES, dict(zip([each.name for each in joints], at, strict=True)))
    panel.show(picture.links, positions)
    with Browser(f"http://127.0.0.1:{server.get_port()}") as page:
        for name in NAMES:
            page.wait_for_text(" ".join(shown(name).split()))
        (client,) = server.get_clients().values()
        for name in NAMES:
            client.add_notification("It wasn't done", name, auto_close_seconds=None)
        wait_for(lambda: page.text.count("It wasn't done") == len(NAMES), "all notifications")
        page.choose(shown(NAMES[0]), shown(NAMES[4]))
        wait_for(lambda: handles(server, viser.GuiDropdownHandle)["Model"].value == NAMES[4], "it")
        panel.show(picture.links, positions)
        page.push_slider(shown(f"{NAMES[1]} joint"), "ArrowRight", 1)
        assert page.run("window.hurt") is None
        own = "e.src.startsWith('data:image/svg+xml')"  # viser's
        assert page.run(f"[...document.images].filter(e => !{own}).map(e => e.src)") == []
        links = page.run("[...document.links].map(e => e.href)")
        assert not [each for each in links if each.startswith("javascript:")]


def test_a_slider_that_is_dragged_leaves_its_joint_where_it_was_left(server):
    """The first command waits for a controller to listen, and the rest of the way is gone meanwhile."""
    listens, commanded = threading.Event(), []

    class Slow:
        def holder(self, joint):
            return self

        def command(self, holder, joint, positions, seconds):
            assert listens.wait(60.0)
            commanded.append(positions[joint])

    panel = panel_of(server, False, Slow(), lambda act: act())
    picture = Picture(server, pytest.fail)
    picture.draw([VisibleModel(1, "arm", [Link("base")], [joint("elbow")])], [])
    panel.set_models(list(picture.models.values()))
    handles(server, viser.GuiDropdownHandle)["Model"].value = "arm"
    panel.show({}, {"arm": {"elbow": 0.0}})
    slider = handles(server, viser.GuiSliderHandle)["elbow"]
    (moved,) = slider._impl.update_cb
    somebody = viser.GuiEvent(client=object(), client_id=0, target=slider)
    drags = []
    for at in np.linspace(0.1, 0.9, 20):
        slider._impl.value = at
        drags.append(threading.Thread(target=moved, args=(somebody,), daemon=True))
        drags[-1].start()
    listens.set()
    for each in drags:
        each.join(60.0)
    assert commanded[-1] == pytest.approx(0.9)
    assert commanded == sorted(commanded)


def test_a_world_in_lockstep_says_so_and_has_nothing_to_pause(server):
    panel = TimePanel(server.gui, None, None)
    status = panel._status
    pause = handles(server, viser.GuiButtonHandle)["Pause"]
    speed = handles(server, viser.GuiDropdownHandle)["Speed"]

    def is_off():
        assert pause.disabled == speed.disabled == (pause.hint == ONLY_STEPS)
        return pause.disabled

    panel.show(590.465, 0.0, True, False)
    assert "590.465 s</b> &nbsp; paused" in status.content
    assert (pause.label, is_off(), panel.stands) == ("Resume", False, True)
    panel.show(590.465, 0.0, True, True)
    assert "590.465 s</b> &nbsp; lock-step, waits for a client's steps" in status.content
    assert (pause.label, is_off(), panel.stands) == ("Pause", True, True)
    panel.show(600.0, 12.34, True, True)
    assert "600.000 s</b> &nbsp; lock-step, 12 × real time" in status.content
    panel.show(600.0, 0.5, False, True)
    assert "lock-step, 0.50 × real time" in status.content
    assert (is_off(), panel.stands) == (True, False)
    panel.show(600.0, 0.0, False, True)
    assert panel.stands
    panel.show(601.0, 1.0, False, False)
    assert "601.000 s</b> &nbsp; real-time factor 1.00" in status.content
    assert (pause.label, is_off(), panel.stands) == ("Pause", False, False)


class Odd:
    """A page whose camera viser refuses to move; a page may say anything of its camera."""

    @property
    def camera(self):
        return self

    @property
    def position(self):
        return np.zeros(3)

    @position.setter
    def position(self, place):
        raise ValueError("Camera look_at cannot equal position")


def test_a_camera_that_cant_be_moved_ends_nothing(server):
    panel = panel_of(server)
    world = panel._world
    panel.set_models([VisibleModel(0, "arm", [Link("base")], [])])
    panel._followed, world.position = "arm", (1.0, 0.0, 0.0)
    server.get_clients = lambda: {0: Odd()}
    panel.follow({})
    assert tuple(world.position) == (0.0, 0.0, 0.0)
    model = SimpleNamespace(name="arm", number=3, static=False, corners=lambda links: np.eye(3))
    picture = SimpleNamespace(links={"arm": None}, models={"arm": model})
    server.initial_camera.position = (0.0, 0.0, 0.0)
    window = SimpleNamespace(_picture=picture, _aimed=set(), _server=server)
    Window._aim(window)
    assert window._aimed == {3}


CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [3.0, 0, 1], "fov": 1.0, "near": 0.01,
    "far": 1000.0, "image_height": 600, "image_width": 800, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
}  # fmt: skip


def test_a_screenshot_of_a_page_that_goes_away_is_one_line(server, monkeypatch):
    told = []
    monkeypatch.setattr(window.rospy, "logwarn", lambda text, *values: told.append(text % values))
    address = f"ws://127.0.0.1:{server.get_port()}"
    with connect(address, subprotocols=[f"viser-v{version('viser')}"], max_size=None) as page:
        page.send(msgspec.msgpack.encode(CAMERA))
        wait_for(server.get_clients, "page")
        (client,) = server.get_clients().values()
        click, asked = SimpleNamespace(client=client), threading.Event()
        monkeypatch.setattr(client, "flush", asked.set)  # once the picture has been asked for
        clicked = threading.Thread(target=Window._screenshot, args=(None, click), daemon=True)
        clicked.start()
        assert asked.wait(60.0)
    clicked.join(60.0)
    assert not clicked.is_alive()
    (line,) = told
    assert line.startswith("The window: no screenshot: ")
