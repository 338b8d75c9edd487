"""`type: module/Class` of a controller: a class of a user's, or one line that says what is wrong."""

import sys

import pytest

from robot_sim.control.controllers import find_type
from robot_sim.control.errors import ControlError

CONTROLLER = '''
from robot_sim.control.controllers.base import Controller

class Spring(Controller):
    type_name = "{module}/Spring"
    interface = "EffortJointInterface"
    @classmethod
    def create(cls, name, params, hardware): return cls(name)
    def update(self, now, dt): pass
'''  # fmt: skip


@pytest.fixture
def module(tmp_path, monkeypatch, request):
    """Writes a module of a name of its own; the text may have {module} in it."""
    monkeypatch.syspath_prepend(tmp_path)
    name = f"types_{abs(hash(request.node.nodeid))}"

    def write(text: str, file: str = "{module}.py") -> str:
        path = tmp_path / file.format(module=name)
        path.parent.mkdir(exist_ok=True)
        path.write_text(text.replace("{module}", name))
        return name

    yield write
    for each in [each for each in sys.modules if each.partition(".")[0] == name]:
        del sys.modules[each]


@pytest.mark.parametrize("place", ["{module}.py", "{module}/__init__.py", "{module}/springs.py"])
def test_a_users_class_is_found(module, place) -> None:
    name = module(CONTROLLER, place)
    if "springs" in place:
        module("from {module}.springs import Spring", "{module}/__init__.py")
    assert find_type(f"{name}/Spring").type_name == f"{name}/Spring"


@pytest.mark.parametrize(
    ("kind", "fault"),
    [(kind, "does not exist: .* has no class") for kind in ("this/X", "builtins/no_such_name")]
    + [(kind, "is not a subclass of .*Controller")
       for kind in ("builtins/eval", "sys/exit", "unittest/TestCase")],
)  # fmt: skip
def test_what_is_no_controller_is_refused(kind, fault) -> None:
    with pytest.raises(ControlError, match=fault):
        find_type(kind)


@pytest.mark.parametrize("kind", ["no_such_package/Controller", "a.b/C", "/", "x", "", "x/"])
def test_what_is_no_module_is_an_unknown_type(kind) -> None:
    assert find_type(kind) is None


@pytest.mark.parametrize(
    "text", ["raise ValueError('x')", "raise SystemExit", "raise GeneratorExit", "import no_such_module"]
)
def test_whatever_an_import_raises_refuses_the_type(module, text) -> None:
    name = module(CONTROLLER + text)
    with pytest.raises(ControlError, match=f"{name} raised"):
        find_type(f"{name}/Spring")


def test_a_class_that_is_no_controller_or_has_another_type_name_is_refused(module) -> None:
    name = module("class Spring:\n    type_name = '{module}/Spring'")
    with pytest.raises(ControlError, match="is not a subclass of robot_sim"):
        find_type(f"{name}/Spring")
    name = module(CONTROLLER.replace('"{module}/Spring"', '"other/Spring"'), "other_{module}.py")
    with pytest.raises(ControlError, match="must say so as type_name"):
        find_type(f"other_{name}/Spring")
