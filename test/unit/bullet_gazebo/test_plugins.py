"""A user's plugin that misbehaves anywhere: the world goes on, and no model is left half there."""

from __future__ import annotations

import sys
import threading
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import pytest
import rospy

from bullet_gazebo.plugins import control_plugin, plugin_loader
from bullet_gazebo.plugins.control_plugin import ControlPlugin
from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from lockstep_runner import world
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World
from robot_sim.sensors.contact import collision_named
from robot_sim.simulator import Simulator
from ros_calls.waiting import wait_until

BOX = """<robot name="box"><link name="body"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>{plugins}</robot>"""
PLUGIN = '<gazebo><plugin name="{0}" filename="lib{0}.so"/></gazebo>'
# Kinds of misbehaviour, in the places where a plugin's code is called.
RAISED = ("SystemExit", "KeyboardInterrupt", "GeneratorExit", "ValueError", "BaseException")
MODULE = """
seen = []

class Rude:
    def __init__(self, context):
        context.on_update(self.update)
        self.misbehave("constructor")
    def update(self, now):
        seen.append("update")
        self.misbehave("update")
    def shutdown(self):
        seen.append("shutdown")
        self.misbehave("shutdown")
    def misbehave(self, here):
        if here == "{place}":
            raise {error}("on purpose")

if "{place}" == "import":
    raise {error}("on purpose")
"""
GOOD = """
seen = []
class Good:
    def __init__(self, context): context.on_update(seen.append)
    def shutdown(self): seen.append("shutdown")
"""
ASKING = """
seen = []
class Asking:
    def __init__(self, context): seen.append(context.link("bodyName"))
    def shutdown(self): pass
"""


class Setting:
    """A simulator in lock-step with plugins of a user's."""

    def __init__(self, sim: Simulator, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._folder = folder
        monkeypatch.syspath_prepend(folder)
        self.places: object = {}
        self.errors: list[str] = []
        monkeypatch.setattr(rospy, "get_param", lambda name, default: self.places)
        for level in ("logerr", "logwarn"):
            monkeypatch.setattr(rospy, level, lambda text, *args: self.errors.append(text % args))
        self.sim = sim
        self.plugins = PluginRegistry(self.sim, None)
        self.modules: list[str] = []

    def write(self, name: str, text: str) -> None:
        (self._folder / f"{name}.py").write_text(text)
        self.modules.append(name)

    def spawn(self, *plugins: str):
        text = BOX.format(plugins="".join(map(PLUGIN.format, plugins)))
        model = self.sim.world.spawn("box", parse_urdf(text), Pose())
        self.plugins.load(model, "")
        return model

    def step(self) -> None:
        with self.sim.lock:
            self.sim.advance(3)

    def delete(self, model) -> None:
        self.plugins.unload(model)
        with self.sim.lock:
            self.sim.delete_model(model)


@pytest.fixture
def setting(sim, tmp_path, monkeypatch):
    made = Setting(sim, tmp_path, monkeypatch)
    yield made
    for name in made.modules:
        sys.modules.pop(name, None)


def test_in_lockstep_a_model_holds_time_for_longer(new_engine, monkeypatch) -> None:
    monkeypatch.setattr(plugin_loader, "LOADING_PATIENCE", 0.01)
    paced, stepped = (Simulator(World(new_engine()), lockstep=each) for each in (False, True))
    with PluginRegistry(stepped, None).time_held("a"), PluginRegistry(paced, None).time_held("b"):
        assert wait_until(lambda: not paced.holds, 60.0, "the end of a hold")
        assert stepped.holds
    assert plugin_loader.LOCKSTEP_LOADING_PATIENCE < world.TIMEOUT  # of a script for a step


@pytest.mark.parametrize("error", RAISED)
@pytest.mark.parametrize("place", ["import", "constructor", "update", "shutdown"])
def test_whatever_a_plugin_raises_the_others_and_the_world_go_on(setting, place, error) -> None:
    rude, good = f"rude_{place}_{error.lower()}", f"good_{place}_{error.lower()}"
    setting.write(rude, MODULE.format(place=place, error=error))
    setting.write(good, GOOD)
    setting.places = {"librude.so": f"{rude}:Rude", "libgood.so": f"{good}:Good"}
    model = setting.spawn("rude", "good")
    setting.step()
    setting.step()
    setting.delete(model)
    assert setting.sim.now == 6_000_000
    assert sys.modules[good].seen == [*range(1_000_000, 7_000_000, 1_000_000), "shutdown"]
    assert len(setting.errors) == 1
    assert error in setting.errors[0] and "librude.so" in setting.errors[0]
    assert setting.sim.listeners == [] and not setting.sim.world.models
    if place == "update":
        assert sys.modules[rude].seen == ["update", "shutdown"]


def test_a_nested_models_plugin_means_its_own_links(setting):
    setting.write("asking", ASKING)
    setting.places = {"libasking.so": "asking:Asking"}
    plugin = '<plugin name="p" filename="libasking.so"><bodyName>{}</bodyName></plugin>'
    inner = f'<model name="arm"><link name="l"/>{plugin.format("l")}</model>'
    text = (
        f'<sdf version="1.6"><model name="m"><link name="l"/><link name="k"/>{inner}'
        f"{plugin.format('k')}{plugin.format('x')}"
        '<joint name="j" type="fixed"><parent>l</parent><child>k</child></joint>'
        '<joint name="i" type="fixed"><parent>l</parent><child>arm::l</child></joint></model></sdf>'
    )
    setting.plugins.load(setting.sim.world.spawn("m", parse_sdf(text), Pose()), "")
    assert sys.modules["asking"].seen == ["arm::l", "k"]
    assert "no link 'x'" in setting.errors[0]


@pytest.mark.parametrize(
    "place", ["os:X", "os:sep", "os", "", ":", "a b:c", None, 3, ["os", "X"], {"os": "X"}]
)
def test_a_place_without_a_plugin_is_reported(setting, place) -> None:
    setting.places = {"librude.so": place}
    setting.delete(setting.spawn("rude"))
    assert setting.errors or place is None


@pytest.mark.parametrize("places", [[], "libgood.so", 3, True])
def test_a_parameter_that_is_no_table_is_a_warning(setting, places) -> None:
    setting.places = places
    setting.delete(setting.spawn("good"))
    assert any("no table" in each for each in setting.errors)


@pytest.mark.parametrize("plugin", ["fetch_drive", "my_robot_control"])
def test_a_foreign_control_plugin_is_told_in_a_line_of_its_own(setting, plugin) -> None:
    setting.spawn("bumper", plugin)
    (told,) = setting.errors
    assert f"plugin lib{plugin}.so is not simulated: this robot has no control here" in told


def test_a_master_that_is_away_leaves_no_model_half_there(setting, monkeypatch) -> None:
    def away(name: str, default: object) -> object:
        raise ConnectionRefusedError("no master")

    monkeypatch.setattr(rospy, "get_param", away)
    setting.delete(setting.spawn("good"))
    assert "no master" in setting.errors[0]


WAITING = """
class Waiting:
    def __init__(self, context):
        context.on_update(lambda now: {call})
    def shutdown(self): pass
"""


@pytest.mark.parametrize(
    "call",
    ["context.sim.pause()", "context.sim.step(1)", "context.sim.reset_simulation()",
     "context.on_update(print)", "context.release()", "context.sim.lock.__enter__()"],
)  # fmt: skip
def test_an_update_that_would_wait_for_itself_is_told(setting, call: str) -> None:
    """It is called under the simulator's lock, and stopped the world without a word."""
    setting.write("waiting", WAITING.format(call=call))
    setting.write("good", GOOD)
    setting.places = {"libwaiting.so": "waiting:Waiting", "libgood.so": "good:Good"}
    setting.spawn("waiting", "good")

    world = threading.Thread(target=setting.step, daemon=True)
    world.start()
    world.join(60.0)
    assert not world.is_alive(), "the world stands still"
    assert len(sys.modules["good"].seen) == 3
    (error,) = setting.errors
    assert "is not called any more" in error and "holds the simulator's lock already" in error


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("left", "left"), ("left_collision", "base_fixed_joint_lump__left_collision_1"),
        ("base_collision_left", "base_fixed_joint_lump__left_collision_1"),
        ("base_fixed_joint_lump__left_collision_1", "base_fixed_joint_lump__left_collision_1"),
        ("right", None),
    ],
)  # fmt: skip
def test_a_bumper_finds_its_collision_in_every_spelling(name, found):
    collisions = ["left_pad", "left", "base_fixed_joint_lump__left_collision_1"]
    assert collision_named(name, "base", collisions) == found


CLOCKED = """
closed = []
class Clocked:
    def __init__(self, context):
        context.closing(lambda: closed.append("topic"))
        context.clock(100.0, self.measure)
        if "{place}" == "constructor":
            raise ValueError("on purpose")
    def measure(self, now):
        closed.append(now)
        if now == 20_000_000:
            raise ValueError("on purpose")
    def shutdown(self): pass
"""


@pytest.mark.parametrize("place", ["constructor", "measure"])
def test_a_clock_ends_with_its_plugin_or_its_fault_and_what_is_open_is_closed(setting, place):
    name = f"clocked_{place}"
    setting.write(name, CLOCKED.replace("{place}", place))
    setting.places = {f"lib{name}.so": f"{name}:Clocked"}
    model = setting.spawn(name)
    with setting.sim.lock:
        setting.sim.advance(40)
    closed = sys.modules[name].closed
    assert closed == (["topic"] if place == "constructor" else [0, 10_000_000, 20_000_000])
    assert len(setting.errors) == 1 and setting.sim.listeners == []
    setting.delete(model)
    assert closed[-1] == "topic" and closed.count("topic") == 1 and len(setting.errors) == 1


def test_what_a_robots_control_lacks_is_told_in_lines_of_its_own(setting, monkeypatch):
    """A foreign kind of simulation, and control that fails."""
    monkeypatch.setattr(rospy, "logfatal", lambda text, *args: setting.errors.append(text % args))
    monkeypatch.setattr(control_plugin, "find_param", lambda *_: "no XML")
    plugin = ControlPlugin.__new__(ControlPlugin)
    arm = SimpleNamespace(name="arm")
    plugin._context = SimpleNamespace(model=arm, text=lambda *_: "their_sim/TheirSim")
    plugin._namespace, plugin._parameter = "/arm", "robot_description"
    plugin._gone, plugin._lock, plugin._started = threading.Event(), threading.Lock(), ExitStack()
    assert plugin._try_start()
    kind, control = setting.errors
    assert kind.startswith("Model 'arm': the <robotSimType> their_sim/TheirSim is not simulated")
    assert "model 'arm' can't start, so this robot has no control here: robot_desc" in control
