"""What one model or world may make its reader read: include bombs, giants, files that are none."""

import os

import numpy as np
import pytest
from support.mutations.mesh_files import obj

from robot_sim.physics.description import DescriptionError, LimitExceeded
from robot_sim.physics.files import mesh_cache, meshes
from robot_sim.physics.files import reading as limits
from robot_sim.physics.files.meshes import read_mesh
from robot_sim.physics.files.reading import Reading, Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.files.world_file import parse_world, read_entity

WIDTH, LEVELS = 10, 7  # a bomb: ten includes of ten includes of ...
MODEL = '<sdf version="1.6"><model name="{}">{}</model></sdf>'
INCLUDE = "<include><uri>model://{}</uri><name>{}</name></include>"
LINK = '<link name="body"/>'


def write_model(folder, name, text):
    (folder / name).mkdir()
    (folder / name / "model.sdf").write_text(text)


def read_world(includes, folder):
    text = f'<sdf version="1.6"><world name="w">{includes}</world></sdf>'
    return parse_world(text, Resources(models=(folder,)))


@pytest.fixture
def bomb(tmp_path):
    """A folder of models: b0 includes b1 ten times, and so on; what is left of them is some links."""
    for level in range(LEVELS):
        inner = "".join(INCLUDE.format(f"b{level + 1}", f"m{i}") for i in range(WIDTH))
        write_model(tmp_path, f"b{level}", MODEL.format(f"b{level}", inner))
    write_model(tmp_path, f"b{LEVELS}", MODEL.format("leaf", LINK))
    return Resources(models=(tmp_path,))


@pytest.fixture
def few_models(monkeypatch):
    """A tenth of the bound."""
    monkeypatch.setattr(limits, "MAX_MODELS", 500)


def test_an_include_bomb_is_refused_as_a_model(bomb):
    """At the latest by the number of its links: it would have ten million."""
    with pytest.raises(DescriptionError) as raised:
        parse_sdf(MODEL.format("m", INCLUDE.format("b0", "m")), resources=bomb)
    assert "there are 1010 links" in str(raised.value) or "(MAX_" in str(raised.value)
    assert "<include> of 'model://b0'" in str(raised.value)


@pytest.mark.usefixtures("few_models")
def test_an_include_bomb_without_links_is_refused_by_the_number_of_models(bomb, tmp_path):
    (tmp_path / f"b{LEVELS}" / "model.sdf").write_text(MODEL.format("leaf", ""))
    with pytest.raises(LimitExceeded, match=r"more than 500 models \(MAX_MODELS\)$"):
        parse_sdf(MODEL.format("m", INCLUDE.format("b0", "m")), resources=bomb)


@pytest.mark.usefixtures("few_models")
def test_a_world_with_a_bomb_is_refused_as_a_whole(bomb, tmp_path):
    """Each of its models alone would be within all limits."""
    includes = "".join(INCLUDE.format(f"b{LEVELS}", f"m{i}") for i in range(600))
    with pytest.raises(LimitExceeded, match=r"more than 500 models \(MAX_MODELS\)"):
        read_world(includes, tmp_path)


def test_a_file_counts_each_time_that_it_is_included(tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MAX_ELEMENTS", 2000)
    write_model(tmp_path, "big", MODEL.format("big", LINK + "<x/>" * 500))
    includes = "".join(INCLUDE.format("big", f"m{i}") for i in range(5))
    with pytest.raises(LimitExceeded, match=r"more than 2000 elements \(MAX_ELEMENTS\)"):
        read_world(includes, tmp_path)


def test_so_many_files_and_bytes_are_read_and_no_more(tmp_path, monkeypatch):
    for name in "abcd":
        write_model(tmp_path, name, MODEL.format(name, LINK + " " * 1000))
    includes = "".join(INCLUDE.format(name, f"x{name}") for name in "abcdabcd")
    monkeypatch.setattr(limits, "MAX_FILES", 4)
    # A file that is known already is none more.
    assert len(read_world(includes, tmp_path).models) == 4
    monkeypatch.setattr(limits, "MAX_FILES", 3)
    with pytest.raises(LimitExceeded) as raised:
        read_world(includes, tmp_path)
    assert f"{tmp_path}/d/model.sdf: more than 3 files" in str(raised.value)
    assert "(MAX_FILES)" in str(raised.value)
    monkeypatch.undo()
    monkeypatch.setattr(limits, "MAX_BYTES", 3000)
    with pytest.raises(LimitExceeded) as raised:
        read_world(includes, tmp_path)
    assert f"{tmp_path}/c/model.sdf: more than 3000 bytes" in str(raised.value)


CHAIR = """<link name="l{0}"><collision name="c"><geometry><mesh>{1}</mesh></geometry></collision></link>"""


def test_a_mesh_is_read_once_however_many_models_have_it(tmp_path, monkeypatch):
    (tmp_path / "chair.obj").write_bytes(obj())
    chair = CHAIR.format("", "<uri>model://chair.obj</uri>")
    write_model(tmp_path, "chair", MODEL.format("chair", chair))
    includes = "".join(INCLUDE.format("chair", f"m{i}") for i in range(5))
    read = []

    def counted(path, submesh):
        read.append(path)
        return read_mesh(path, submesh)

    monkeypatch.setattr(limits, "read_mesh", counted)
    world = read_world(includes, tmp_path)
    assert read == [tmp_path / "chair.obj"]
    solids = [model.links["l"].collisions[0].solid for model in world.models.values()]
    assert len(solids) == 5
    assert all(solid is solids[0] for solid in solids)


@pytest.mark.parametrize("kind", ["urdf", "sdf", "world"])
def test_so_many_bytes_of_meshes_are_read_and_no_more(tmp_path, monkeypatch, kind):
    """The same file counts once; a world is refused as a whole."""
    for name in ("a.obj", "b.obj"):
        (tmp_path / name).write_bytes(obj())
    paths = [tmp_path / name for name in ("a.obj", "a.obj", "b.obj")]
    if kind == "urdf":
        mesh = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
        inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
        text = f'<robot name="r"><link name="l">{inertial}{"".join(map(mesh.format, paths))}</link></robot>'
    else:
        chairs = "".join(CHAIR.format(i, f"<uri>{path}</uri>") for i, path in enumerate(paths))
        text = MODEL.format("m", f"<static>1</static>{chairs}")
    if kind == "world":
        text = text.replace("<model ", '<world name="w"><model ')
        text = text.replace("</sdf>", "</world></sdf>")
    read = {"urdf": parse_urdf, "sdf": parse_sdf, "world": parse_world}[kind]
    monkeypatch.setattr(limits, "MAX_MESH_BYTES", 2 * len(obj()))
    read(text, resources=Resources())
    monkeypatch.setattr(limits, "MAX_MESH_BYTES", 2 * len(obj()) - 1)
    with pytest.raises(LimitExceeded, match=r"bytes of mesh files \(MAX_MESH_BYTES\)") as raised:
        read(text, resources=Resources())
    assert f"{tmp_path}/b.obj" in str(raised.value)


@pytest.mark.parametrize("read", [parse_urdf, parse_sdf])
def test_time_is_bounded_and_told(monkeypatch, read):
    monkeypatch.setattr(limits, "MAX_SECONDS", 0.0)
    link = '<link name="body"><inertial><mass value="1"/></inertial></link>'
    text = f'<robot name="r">{link}</robot>' if read is parse_urdf else MODEL.format("m", link)
    with pytest.raises(LimitExceeded, match=r"reading takes more than 0 s \(MAX_SECONDS\)"):
        read(text)


def test_reading_ends_when_it_is_cancelled():
    asked = []

    def cancelled():
        asked.append(None)
        return len(asked) > 3

    text = MODEL.format("m", "".join(f'<link name="l{i}"/>' for i in range(900)))
    with pytest.raises(LimitExceeded, match="reading was interrupted"):
        read_entity(text, "m", Resources(), Reading(cancelled))
    assert len(asked) == 4


def test_values_of_megabytes_are_refused_in_a_short_line():
    long = "1 " * 5_000_000
    with pytest.raises(DescriptionError) as raised:
        parse_sdf(MODEL.format("m", f'<link name="a"><pose>{long}</pose></link>'))
    assert "link 'a': <pose> must hold 6 numbers, not '1 1 1" in str(raised.value)
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
    link = '<link name="a&#10;[FATAL] x"/>'
    with pytest.raises(DescriptionError, match=r"link 'a \[FATAL\] x' is there twice"):
        parse_urdf(f'<robot name="r">{link}{link}</robot>')


ODD = {
    "pipe": os.mkfifo,
    "loop": lambda path: path.symlink_to("loop"),
    "zero": lambda path: path.symlink_to("/dev/zero"),
    "folder": lambda path: (path / "model.sdf").mkdir(parents=True),
    "empty": lambda path: path.mkdir(),
}


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("scheme", ["file://{}/", "model://", "{}/"])
def test_files_that_are_none_are_refused_at_once(tmp_path, name, scheme):
    ODD[name](tmp_path / name)
    uri = scheme.format(tmp_path) + name
    with pytest.raises(DescriptionError) as raised:
        parse_sdf(MODEL.format("m", INCLUDE.format("", "m").replace("model://", uri)),
                  resources=Resources(models=(tmp_path,)))  # fmt: skip
    assert f"<include> of '{uri[:50]}" in str(raised.value)  # long ones are shortened
    assert name in str(raised.value)


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
    with pytest.raises(DescriptionError) as raised:
        parse_sdf(MODEL.format("m", f"<include><uri>{uri}</uri></include>"),
                  resources=Resources(models=(tmp_path,)))  # fmt: skip
    assert fault in str(raised.value)


def test_versions_of_any_length_are_versions_or_none(tmp_path):
    with pytest.raises(DescriptionError, match="isn't a version 1.x"):
        parse_sdf(f'<sdf version="1.{"9" * 5000}"><model name="m">{LINK}</model></sdf>')
    (tmp_path / "m").mkdir()
    config = f'<model><sdf version="1.{"9" * 5000}">model.sdf</sdf></model>'
    (tmp_path / "m" / "model.config").write_text(config)
    (tmp_path / "m" / "model.sdf").write_text(MODEL.format("m", LINK))
    text = MODEL.format("x", INCLUDE.format("m", "y"))
    assert parse_sdf(text, resources=Resources(models=(tmp_path,)))


def test_each_model_of_a_world_has_its_own_limits(tmp_path, monkeypatch):
    """Many models that are read in time are read, however long all of them take."""
    for name in "abc":
        (tmp_path / f"{name}.obj").write_bytes(obj())
        chair = CHAIR.format("", f"<uri>model://{name}.obj</uri>")
        write_model(tmp_path, name, MODEL.format(name, chair))
    includes = "".join(INCLUDE.format(name, name) for name in "abc")
    monkeypatch.setattr(limits, "MAX_MESH_BYTES", len(obj()))
    seconds = iter(range(0, 1000, 7))
    monkeypatch.setattr(limits.time, "thread_time", lambda: float(next(seconds)))
    assert len(read_world(includes, tmp_path).models) == 3
    monkeypatch.setattr(limits, "MAX_SECONDS", 1.0)
    with pytest.raises(LimitExceeded, match=r"more than 1 s \(MAX_SECONDS\)"):
        read_world(includes, tmp_path)


def test_long_reading_says_how_far_it_is(tmp_path, monkeypatch, caplog):
    write_model(tmp_path, "a", MODEL.format("a", LINK))
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


def test_a_large_mesh_is_read_once_by_its_content(large):
    path, cache = large
    first = read_mesh(path)
    (file,) = cache.iterdir()
    before = file.stat().st_ino
    other = path.with_name("copy.obj")
    other.write_bytes(path.read_bytes())
    for again in (read_mesh(path), read_mesh(other)):
        assert again == first
        for one, two in zip(
            (first.vertices, first.faces, *first.hulls),
            (again.vertices, again.faces, *again.hulls),
            strict=True,
        ):
            assert one.tobytes() == two.tobytes()
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
