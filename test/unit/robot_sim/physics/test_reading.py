"""What one model or world may make its reader read: include bombs, giants, files that are none."""

import os
from unittest.mock import Mock

import numpy as np
import pytest
from support.mutations.mesh_files import obj
from support.refusals import refused
from support.robots.snippets import link, robot, sdf, sdf_world

from robot_sim.physics.description import DescriptionError, LimitExceeded
from robot_sim.physics.files import mesh_cache, meshes
from robot_sim.physics.files import reading as limits
from robot_sim.physics.files.meshes import read_mesh
from robot_sim.physics.files.reading import Reading, Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.files.world_file import parse_world, read_entity

WIDTH, LEVELS = 10, 7  # a bomb: ten includes of ten includes of ...
INCLUDE = "<include><uri>model://{}</uri><name>{}</name></include>"
LINK = '<link name="body"/>'


def write_model(folder, name, *parts):
    (folder / name).mkdir()
    (folder / name / "model.sdf").write_text(sdf(*parts, name=name))


def read_world(includes, folder):
    return parse_world(sdf_world(includes), Resources(models=(folder,)))


def parse_bomb(resources):
    parse_sdf(sdf(INCLUDE.format("b0", "m")), resources=resources)


@pytest.fixture
def bomb(tmp_path):
    """A folder of models: b0 includes b1 ten times, and so on; what is left of them is some links."""
    for level in range(LEVELS):
        inner = "".join(INCLUDE.format(f"b{level + 1}", f"m{i}") for i in range(WIDTH))
        write_model(tmp_path, f"b{level}", inner)
    write_model(tmp_path, f"b{LEVELS}", LINK)
    return Resources(models=(tmp_path,))


@pytest.fixture
def few_models(monkeypatch):
    """A tenth of the bound."""
    monkeypatch.setattr(limits, "MAX_MODELS", 500)


def test_an_include_bomb_is_refused_as_a_model(bomb):
    """At the latest by the number of its links: it would have ten million."""
    with pytest.raises(DescriptionError, match=r"there are 1010 links|\(MAX_") as raised:
        parse_bomb(bomb)
    assert "<include> of 'model://b0'" in str(raised.value)


@pytest.mark.usefixtures("few_models")
def test_an_include_bomb_without_links_is_refused_by_the_number_of_models(bomb, tmp_path):
    """So is a world, as a whole, of which each model alone would be within all limits."""
    (tmp_path / f"b{LEVELS}" / "model.sdf").write_text(sdf())
    with pytest.raises(LimitExceeded, match=r"more than 500 models \(MAX_MODELS\)$"):
        parse_bomb(bomb)
    write_model(tmp_path, "one", LINK)
    with pytest.raises(LimitExceeded, match=r"more than 500 models \(MAX_MODELS\)"):
        read_world("".join(INCLUDE.format("one", f"m{i}") for i in range(600)), tmp_path)


def test_a_file_counts_each_time_that_it_is_included(tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MAX_ELEMENTS", 2000)
    write_model(tmp_path, "big", LINK, "<x/>" * 500)
    includes = "".join(INCLUDE.format("big", f"m{i}") for i in range(5))
    with pytest.raises(LimitExceeded, match=r"more than 2000 elements \(MAX_ELEMENTS\)"):
        read_world(includes, tmp_path)


def test_so_many_files_and_bytes_are_read_and_no_more(tmp_path, monkeypatch):
    for name in "abcd":
        write_model(tmp_path, name, LINK, " " * 1000)
    includes = "".join(INCLUDE.format(name, f"x{name}") for name in "abcdabcd")
    monkeypatch.setattr(limits, "MAX_FILES", 4)
    # A file that is known already is none more.
    assert len(read_world(includes, tmp_path).models) == 4
    monkeypatch.setattr(limits, "MAX_FILES", 3)
    with refused(f"{tmp_path}/d/model.sdf: more than 3 files", "(MAX_FILES)", error=LimitExceeded):
        read_world(includes, tmp_path)
    monkeypatch.undo()
    monkeypatch.setattr(limits, "MAX_BYTES", 3000)
    with refused(f"{tmp_path}/c/model.sdf: more than 3000 bytes", error=LimitExceeded):
        read_world(includes, tmp_path)


CHAIR = """<link name="l{0}"><collision name="c"><geometry><mesh>{1}</mesh></geometry></collision></link>"""


def test_a_mesh_is_read_once_however_many_models_have_it(tmp_path, monkeypatch):
    (tmp_path / "chair.obj").write_bytes(obj())
    chair = CHAIR.format("", "<uri>model://chair.obj</uri>")
    write_model(tmp_path, "chair", chair)
    includes = "".join(INCLUDE.format("chair", f"m{i}") for i in range(5))
    counted = Mock(wraps=read_mesh)
    monkeypatch.setattr(limits, "read_mesh", counted)
    world = read_world(includes, tmp_path)
    assert [each.args[0] for each in counted.call_args_list] == [tmp_path / "chair.obj"]
    solids = [model.links["l"].collisions[0].solid for model in world.models.values()]
    assert len(solids) == 5
    assert all(solid is solids[0] for solid in solids)


@pytest.mark.parametrize("kind", ["urdf", "sdf", "world"])
def test_so_many_bytes_of_meshes_are_read_and_no_more(tmp_path, monkeypatch, kind):
    """The same file counts once; a world is refused as a whole."""
    for name in ("a.obj", "b.obj"):
        (tmp_path / name).write_bytes(obj())
    paths = [tmp_path / name for name in ("a.obj", "a.obj", "b.obj")]
    mesh = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
    chairs = "".join(CHAIR.format(i, f"<uri>{path}</uri>") for i, path in enumerate(paths))
    read, text = {
        "urdf": (parse_urdf, robot(link("l", more="".join(map(mesh.format, paths))))),
        "sdf": (parse_sdf, sdf(chairs, static=True)),
        "world": (parse_world, sdf_world(f'<model name="m"><static>1</static>{chairs}</model>')),
    }[kind]
    monkeypatch.setattr(limits, "MAX_MESH_BYTES", 2 * len(obj()))
    read(text, resources=Resources())
    monkeypatch.setattr(limits, "MAX_MESH_BYTES", 2 * len(obj()) - 1)
    told = f"{tmp_path}/b.obj", "bytes of mesh files (MAX_MESH_BYTES)"
    with refused(*told, error=LimitExceeded):
        read(text, resources=Resources())


@pytest.mark.parametrize(("read", "text"), [(parse_urdf, robot(link("l"))), (parse_sdf, sdf(LINK))])
def test_time_is_bounded_and_told(monkeypatch, read, text):
    monkeypatch.setattr(limits, "MAX_SECONDS", 0.0)
    with pytest.raises(LimitExceeded, match=r"reading takes more than 0 s \(MAX_SECONDS\)"):
        read(text)


def test_reading_ends_when_it_is_cancelled():
    cancelled = Mock(side_effect=[False, False, False, True])
    text = sdf(*(f'<link name="l{i}"/>' for i in range(900)))
    with pytest.raises(LimitExceeded, match="reading was interrupted"):
        read_entity(text, "m", Resources(), Reading(cancelled))


def test_values_of_megabytes_are_refused_in_a_short_line():
    with refused("link 'a': <pose> must hold 6 numbers, not '1 1 1"):
        parse_sdf(sdf(f'<link name="a"><pose>{"1 " * 5_000_000}</pose></link>'))
    name = "n" * 1_000_000
    for text in (
        f'<robot name="r"><link name="a"/><joint name="j" type="{name}"/></robot>',
        f'<robot name="r"><{name}/></robot>',
        f'<robot name="r"><link name="a"><visual><geometry><{name}/></geometry></visual></link></robot>',
        f'<robot name="r"><gazebo reference="{name}"/><link name="a"/></robot>',
        f"<{name}/>",
    ):
        with pytest.raises(DescriptionError) as raised:
            parse_urdf(text)
        assert len(str(raised.value)) < 5000


def test_a_name_with_a_line_end_makes_no_second_line_in_a_log():
    with refused("link 'a [FATAL] x' is there twice"):
        parse_urdf(robot('<link name="a&#10;[FATAL] x"/>' * 2))


ODD = {
    "pipe": os.mkfifo,
    "loop": lambda path: path.symlink_to("loop"),
    "zero": lambda path: path.symlink_to("/dev/zero"),
    "folder": lambda path: (path / "model.sdf").mkdir(parents=True),
    "empty": lambda path: path.mkdir(),
}


def include(folder, uri):
    text = sdf(f"<include><uri>{uri}</uri></include>")
    parse_sdf(text, resources=Resources(models=(folder,)))


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("scheme", ["file://{}/", "model://", "{}/"])
def test_files_that_are_none_are_refused_at_once(tmp_path, name, scheme):
    ODD[name](tmp_path / name)
    uri = scheme.format(tmp_path) + name
    with refused(f"<include> of '{uri[:50]}", name):  # long ones are shortened
        include(tmp_path, uri)


@pytest.mark.parametrize(
    ("uri", "fault"),
    [
        ("gz://models/box", "gz:// is not supported"),
        ("https://fuel.gazebosim.org/1.0/m", "https:// is not supported"),
        ("file:///dev/zero", "it is not a file"),
        ("file:///dev/tty", "it is not a file"),
        ("/proc/self/mem", "it can't be read"),
        ("model://" + "x" * 5000, "File name too long"),
        ("model://%00", "is not found"),
        ("~%00/x", "null byte"),
        ("", "<uri> is missing"),
    ],
)
def test_uris_that_lead_nowhere(tmp_path, uri, fault):
    with refused(fault):
        include(tmp_path, uri)


def test_versions_of_any_length_are_versions_or_none(tmp_path):
    version = "1." + "9" * 5000
    with refused("isn't a version 1.x"):
        parse_sdf(sdf(LINK, version=version))
    write_model(tmp_path, "m", LINK)
    config = f'<model><sdf version="{version}">model.sdf</sdf></model>'
    (tmp_path / "m" / "model.config").write_text(config)
    include(tmp_path, "model://m")


def test_each_model_of_a_world_has_its_own_limits(tmp_path, monkeypatch):
    """Many models that are read in time are read, however long all of them take."""
    for name in "abc":
        (tmp_path / f"{name}.obj").write_bytes(obj())
        write_model(tmp_path, name, CHAIR.format("", f"<uri>model://{name}.obj</uri>"))
    includes = "".join(INCLUDE.format(name, name) for name in "abc")
    monkeypatch.setattr(limits, "MAX_MESH_BYTES", len(obj()))
    seconds = iter(range(0, 1000, 7))
    monkeypatch.setattr(limits.time, "thread_time", lambda: float(next(seconds)))
    assert len(read_world(includes, tmp_path).models) == 3
    monkeypatch.setattr(limits, "MAX_SECONDS", 1.0)
    with pytest.raises(LimitExceeded, match=r"more than 1 s \(MAX_SECONDS\)"):
        read_world(includes, tmp_path)


def test_long_reading_says_how_far_it_is(tmp_path, monkeypatch, caplog):
    write_model(tmp_path, "a", LINK)
    monkeypatch.setattr(limits, "TELLING", -1.0)
    with caplog.at_level("INFO", logger="rosout"):
        read_world(INCLUDE.format("a", "x") + INCLUDE.format("a", "y"), tmp_path)
    assert "2 of 2 entities of the world file are read" in caplog.messages


@pytest.fixture
def large(tmp_path, monkeypatch):
    """A mesh file that is worth keeping, and the folder that keeps it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "large.obj"
    path.write_bytes(obj() + b"# " + b"x" * 500_000)
    return path, tmp_path / "cache" / "robot_sim" / "meshes"


def arrays(mesh):
    return [each.tobytes() for each in (mesh.vertices, mesh.faces, *mesh.hulls)]


def test_a_large_mesh_is_read_once_by_its_content(large):
    path, cache = large
    first = read_mesh(path)
    (file,) = cache.iterdir()
    before = file.stat().st_ino
    other = path.with_name("copy.obj")
    other.write_bytes(path.read_bytes())
    for again in (read_mesh(path), read_mesh(other)):
        assert again == first
        assert arrays(again) == arrays(first)
    assert [each.stat().st_ino for each in cache.iterdir()] == [before]
    other.write_bytes(path.read_bytes().replace(b"v -1", b"v -2", 1))
    assert read_mesh(other) != first
    assert len(list(cache.iterdir())) == 2


def test_a_kept_mesh_is_read_without_the_child_process(large, monkeypatch):
    path, _ = large
    first = read_mesh(path)
    monkeypatch.setattr(meshes, "_process", None)
    assert read_mesh(path) == first


@pytest.mark.parametrize("damage", [b"", b"nonsense", None])
def test_a_damaged_mesh_in_the_cache_is_read_anew(large, damage):
    path, cache = large
    first = read_mesh(path)
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-40] if damage is None else damage)
    assert read_mesh(path) == first
    assert file.read_bytes() == whole


def test_the_cache_has_a_bound(tmp_path, monkeypatch):
    names = [tmp_path / name for name in "abc"]
    for number, path in enumerate(names):
        mesh_cache.kept(path, lambda: bytes(mesh_cache.written([np.zeros(1000)])))
        os.utime(path, (number, number))
    monkeypatch.setattr(mesh_cache, "MOST_BYTES", 20_000)
    mesh_cache.kept(names[0], bytes)  # used now
    mesh_cache.kept(tmp_path / "d", lambda: bytes(mesh_cache.written([np.zeros(100)])))
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a", "c", "d"]
