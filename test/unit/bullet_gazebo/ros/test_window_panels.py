"""The window's panels on a real page, without a simulator and without a browser."""

import sys
import threading

import numpy as np
import pytest
import viser

from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.pictures.page.picture import Picture
from bullet_gazebo.pictures.page.seen import SeenJoint, SeenLink, SeenModel
from bullet_gazebo.ros.clients.window.model_panel import NONE, ModelPanel

ROUNDS = 300
SWITCH = 1e-5  # [s] after which another thread has its turn
JOINTS = {"one": 3, "many": 20}  # of each model


@pytest.fixture
def server():
    server = viser.ViserServer("127.0.0.1", 0, verbose=False)
    yield server
    server.stop()


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
    return SeenJoint(name, "revolute", "base", Pose(), (0.0, 0.0, 1.0), -1.0, 1.0)


def test_models_are_chosen_while_another_thread_shows_them(server, interleaved):
    """Time that runs and stands by turns switches sliders off and on, which removed ones refuse."""
    stands = False
    panel = ModelPanel(server, None, NoControllers(), None, lambda: stands)
    picture = Picture(server, pytest.fail)
    names = {name: [f"{name}_{i}" for i in range(count)] for name, count in JOINTS.items()}
    picture.draw(
        [
            SeenModel(number, name, [SeenLink("base", [])], [joint(each) for each in names[name]])
            for number, name in enumerate(names)
        ],
        [],
    )
    picture.move(np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]] * len(names)))
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
        panel.show(picture.links, {name: [at] * len(each) for name, each in names.items()})
        if stands:
            panel.set_models(models)
    for name in [*names, NONE]:
        choice.value = name
        panel.show(picture.links, {})
        assert sorted(handles(server, viser.GuiSliderHandle)) == sorted(names.get(name, []))
