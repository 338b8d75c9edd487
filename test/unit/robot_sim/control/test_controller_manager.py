"""The controller manager's table of cases (docs/contract/ros_control.md 1.3 to 1.7)."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from support.robots.cartpole import cartpole_urdf

from robot_sim.control.controllers.base import Controller
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.manager import STRICT, ControllerManager
from robot_sim.control.transmissions import read_description

POSITION = {"type": "effort_controllers/JointPositionController"}
PARAMS = {
    "states": {"type": "joint_state_controller/JointStateController", "publish_rate": 120},
    "cart": POSITION | {"joint": "stand_cart", "pid": {"p": 1.0}},
    "cart2": POSITION | {"joint": "stand_cart", "pid": {"p": 2.0}},
    "pole": POSITION | {"joint": "cart_pole", "pid": {"p": 3.0}},
}


@pytest.fixture
def manager():
    manager = ControllerManager(RobotHardware(read_description(cartpole_urdf())))
    for name, params in PARAMS.items():
        manager.load(name, params)
    return manager


def states(manager):
    return {entry.name: entry.state for entry in manager.loaded}


@pytest.mark.parametrize(
    ("name", "params", "text"),
    [
        ("cart", PARAMS["cart"], "already loaded"),
        ("new", None, "type was not specified"),
        ("new", {"joint": "stand_cart"}, "type was not specified"),
        ("new", {"type": "no/Such"}, "does not exist"),
        ("new", PARAMS["cart"] | {"joint": "elbow"}, "Initializing controller 'new' failed"),
    ],
)
def test_what_cannot_be_loaded_is_refused_and_leaves_no_trace(manager, name, params, text):
    before = manager.loaded
    with pytest.raises(ControlError, match=text):
        manager.load(name, params)
    assert manager.loaded == before


def test_moved_joints_relatch_running_controllers(manager):
    manager.switch(["cart"], [], STRICT)
    joint, cart = manager.hardware.joints["stand_cart"], manager.get("cart")
    cart.command(0.5)
    manager.update(1, 0.001)
    joint.position = -0.1
    manager.joints_moved(2, relatch=False)
    assert (cart.set_point, joint.command) == (0.5, 0.5)
    manager.joints_moved(2, relatch=True)
    assert (cart.set_point, joint.command) == (-0.1, 0.0)


class Faulty(Controller):
    """Raises where it is told to."""

    type_name = "test/Faulty"
    interface = "EffortJointInterface"

    error: type[BaseException] = ZeroDivisionError

    def __init__(self, name, where):
        super().__init__(name)
        self.where = where
        self.calls = []

    @classmethod
    def create(cls, name, params, hardware):
        if params["where"] == "create":
            raise KeyError("create")
        return cls(name, params["where"])

    def _act(self, what):
        self.calls.append(what)
        if what == self.where:
            raise self.error(what)

    def starting(self, now):
        self._act("starting")

    def update(self, now, dt):
        self._act("update")

    def stopping(self):
        self._act("stopping")

    def joints_moved(self, now):
        self._act("joints_moved")


@pytest.fixture
def faults(manager):
    told = []
    manager.types["test/Faulty"] = Faulty
    manager.on_fault = lambda controller, error: told.append((controller.name, str(error)))
    return told


@pytest.mark.parametrize(
    "error", [ZeroDivisionError, SystemExit, GeneratorExit, KeyboardInterrupt, BaseException]
)
@pytest.mark.parametrize("where", ["update", "joints_moved"])
def test_a_controller_that_raises_is_stopped_once_and_the_others_go_on(
    manager, faults, where, error, monkeypatch
):
    monkeypatch.setattr(Faulty, "error", error)
    faulty = manager.load("faulty", {"type": "test/Faulty", "where": where})
    manager.switch(["faulty", "cart"], [], STRICT)
    manager.get("cart").command(0.5)

    def run():
        for now in (1, 2):
            manager.update(now, 0.001)
            manager.joints_moved(now, relatch=False)

    with ThreadPoolExecutor(1) as simulation:  # Ctrl-C raises nothing there
        simulation.submit(run).result()
    assert faults == [("faulty", where)]
    assert faulty.calls[-1] == "stopping"
    assert states(manager)["faulty"] == "stopped"
    assert states(manager)["cart"] == "running"
    assert manager.hardware.joints["stand_cart"].command != 0.0


def test_a_ctrl_c_that_comes_while_a_controller_is_updated_is_no_fault_of_its(manager, faults, monkeypatch):
    monkeypatch.setattr(Faulty, "error", KeyboardInterrupt)
    manager.load("faulty", {"type": "test/Faulty", "where": "update"})
    manager.switch(["faulty"], [], STRICT)
    with pytest.raises(KeyboardInterrupt):
        manager.update(1, 0.001)
    assert states(manager)["faulty"] == "running" and not faults


def test_one_that_raises_while_it_is_made_or_started_is_refused_and_stops_all_the_same(manager, faults):
    with pytest.raises(ControlError, match="Initializing controller 'faulty' failed: KeyError"):
        manager.load("faulty", {"type": "test/Faulty", "where": "create"})
    assert "faulty" not in states(manager)
    faulty = manager.load("faulty", {"type": "test/Faulty", "where": "starting"})
    with pytest.raises(ControlError, match=r"Could not start \['faulty'\]"):
        manager.switch(["faulty", "cart"], [], STRICT)
    assert (states(manager)["faulty"], states(manager)["cart"]) == ("stopped", "running")
    faulty.where = "stopping"
    manager.switch(["faulty"], [], STRICT)
    manager.switch([], ["faulty"], STRICT)
    assert states(manager)["faulty"] == "stopped"
    assert faults == [("faulty", "starting"), ("faulty", "stopping")]


CLAIM = "isn't a tuple of names of controlled joints"


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"name": "cart"}, "calls itself 'cart'"),
        ({"interface": 3}, "lacks `interface`"),
        *(({"claimed": claimed}, CLAIM) for claimed in ("stand_cart", ("elbow",), None, (3,))),
        (None, "returned None"),
    ],
)
def test_what_could_not_be_listed_is_refused(manager, faults, change, text, monkeypatch):
    made = Faulty("faulty", "")
    vars(made).update(change or {})
    monkeypatch.setattr(Faulty, "create", lambda *_: made if change else None)
    with pytest.raises(ControlError, match=text):
        manager.load("faulty", {"type": "test/Faulty"})
    assert "faulty" not in states(manager)
