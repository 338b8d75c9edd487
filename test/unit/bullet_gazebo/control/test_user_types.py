"""`type: module/Class` of a controller: which modules are imported for it, and which are not."""

import sys

import pytest

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.user_types import find_type

CONTROLLER = '''
from bullet_gazebo.control.controllers.base import Controller

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


@pytest.mark.parametrize("place", ["{module}.py", "{module}/__init__.py"])
def test_a_users_class_is_found(module, place) -> None:
    name = module(CONTROLLER, place)
    assert find_type(f"{name}/Spring").type_name == f"{name}/Spring"


def test_it_may_lie_in_a_module_of_the_package(module) -> None:
    module(CONTROLLER, "{module}/springs.py")
    name = module("from {module}.springs import Spring", "{module}/__init__.py")
    assert find_type(f"{name}/Spring").__name__ == "Spring"


@pytest.mark.parametrize("kind", ["this/X", "this/s", "antigravity/webbrowser", "turtle/Pencil"])
def test_a_module_without_such_a_class_is_not_imported(kind) -> None:
    package = kind.partition("/")[0]
    sys.modules.pop(package, None)
    with pytest.raises(ControlError, match="does not exist"):
        find_type(kind)
    assert package not in sys.modules


def test_nor_is_one_whose_class_of_that_name_is_no_controller_of_that_type(module) -> None:
    name = module("import sys\nsys.exit('run')\nclass Spring:\n    type_name = 'other/Spring'")
    with pytest.raises(
        ControlError, match=f"no class Spring with the line type_name = '{name}/Spring'"
    ):
        find_type(f"{name}/Spring")
    with pytest.raises(ControlError, match="does not exist"):
        find_type("unittest/TestCase")


@pytest.mark.parametrize(
    "kind",
    [
        "builtins/eval",
        "sys/exit",
        "posix/system",
        "no_such_package/Controller",
        "a.b/C",
        "/",
        "x",
        "",
        "x/",
    ],
)
def test_what_is_no_module_with_a_source_is_an_unknown_type(kind) -> None:
    assert find_type(kind) is None


@pytest.mark.parametrize(
    "text",
    ["raise ValueError('x')", "raise SystemExit", "raise GeneratorExit", "import no_such_module"],
)
def test_whatever_an_import_raises_refuses_the_type(module, text) -> None:
    name = module(CONTROLLER + text)
    with pytest.raises(ControlError, match=f"{name} raised"):
        find_type(f"{name}/Spring")


def test_a_class_that_only_says_so_is_refused(module) -> None:
    name = module("class Spring:\n    type_name = '{module}/Spring'")
    with pytest.raises(ControlError, match="is no bullet_gazebo"):
        find_type(f"{name}/Spring")
