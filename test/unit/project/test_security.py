"""What docs/security.md promises about files, imports and folders."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.reading import Reading, Resources
from robot_sim.physics.files.world_file import read_entity

ROOT = Path(__file__).resolve().parents[3]
MODULES = sorted(
    path for folder in ("src", "scripts", "companions") for path in (ROOT / folder).rglob("*.py")
)
# What runs code of whoever wrote the file or the text.
DANGEROUS = {
    "eval", "exec", "compile", "os.system", "os.popen", "pickle.load", "pickle.loads", "yaml.load",
    "marshal.load", "marshal.loads", "shelve.open", "joblib.load", "cloudpickle.load", "dill.load",
}  # fmt: skip
# The launcher runs the script that its user names, as `python3 script.py` does.
RUNS_A_SCRIPT = {("src/lockstep_runner/script.py", name) for name in ("compile", "exec")}
# The process that draws a video reads what its own parent writes into their pipe.
READS_ITS_PARENT = {("src/robot_sim/pictures/films.py", "pickle.load")}
MODEL = '<sdf version="1.6"><model name="m">{}</model></sdf>'
INCLUDE = "<include><uri>{}</uri></include>"
MESH = """<link name="l"><collision name="c"><geometry><mesh><uri>{}</uri></mesh></geometry></collision>
</link>"""


def spawn(entity: str) -> None:
    """Reads a model with it, as a client may have it spawned."""
    read_entity(MODEL.format(entity), "m", Resources(), Reading())


def calls(path: Path) -> Iterator[tuple[str, ast.Call]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


@pytest.mark.slow
def test_no_file_is_run_as_code() -> None:
    for path in MODULES:
        for name, call in calls(path):
            options = {each.arg: ast.unparse(each.value) for each in call.keywords}
            if (str(path.relative_to(ROOT)), name) not in RUNS_A_SCRIPT | READS_ITS_PARENT:
                assert name not in DANGEROUS, f"{path}:{call.lineno}"
            assert options.get("shell", "False") == "False", f"{path}:{call.lineno}"
            if name == "torch.load":
                assert options["weights_only"] == "True", f"{path}:{call.lineno}"


@pytest.mark.parametrize("entity", [INCLUDE, MESH], ids=["include", "mesh"])
@pytest.mark.parametrize("scheme", ["http", "https", "ftp"])
def test_nothing_is_fetched_from_a_network(entity: str, scheme: str) -> None:
    uri = f"{scheme}://127.0.0.1:9/thing.stl"
    with pytest.raises(DescriptionError, match=f"{scheme}:// is not supported"):
        spawn(entity.format(uri))


@pytest.mark.parametrize("entity", [INCLUDE, MESH], ids=["include", "mesh"])
@pytest.mark.parametrize("name", ["secret.sdf", "secret.stl", "secret.obj", "secret.dae"])
def test_the_contents_of_a_file_are_not_given_back(entity: str, name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("s3same hunter2\n")
    with pytest.raises(DescriptionError) as raised:
        spawn(entity.format(f"file://{tmp_path}/{name}"))
    assert name in str(raised.value)
    assert "s3same" not in str(raised.value) and "hunter2" not in str(raised.value)
