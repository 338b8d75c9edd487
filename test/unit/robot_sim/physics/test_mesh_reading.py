"""Mesh files into arrays: what is read, and what is refused, by which words."""

import re

import numpy as np
import pytest
from support.mutations.mesh_files import CORNERS, ascii_stl, binary_stl, dae, library, obj, polylist

from file_access.limited import Limits
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files import mesh_program, meshes
from robot_sim.physics.files.hull import MOST_POINTS, hull_points
from robot_sim.physics.files.meshes import read_mesh

CUBE = np.array(sorted(CORNERS))
OBJ, DAE, POLYLIST, TEXT = (data.decode() for data in (obj(), dae(), polylist(), ascii_stl()))
POSITIONS = DAE[DAE.index("<p>") + 3 : DAE.index("</p>")]
NODES = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema">
<asset><unit meter="0.5"/><up_axis>Y_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="s"><float_array count="12">0 0 0 2 0 0 0 4 0 0 0 6</float_array><technique_common>
<accessor stride="3"><param name="X"/><param name="Y"/><param name="Z"/></accessor></technique_common>
</source><vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 1 3</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="w"><node><translate>1 0 0</translate>
<rotate>0 0 1 90</rotate><scale>1 1 2</scale><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes></COLLADA>"""
WELL = {
    "cube.stl": binary_stl(),
    "behind.stl": binary_stl() + b"what some programs write",
    "solid.stl": b"solid" + binary_stl()[5:],  # a header that looks like a text's
    "text.stl": TEXT,
    "crlf.stl": TEXT.replace("\n", "\r\n"),
    "line.stl": TEXT.replace("\n", " "),
    "upper.stl": TEXT.upper(),
    "name.stl": TEXT.replace("solid cube", "solid vertex of a solid facet"),
    "end.stl": TEXT.replace("endsolid cube", ""),
    "latin.stl": TEXT.replace("cube", "W\u00fcrfel").encode("latin-1"),
    "mark.stl": "\ufeff" + TEXT,
    "solids.stl": TEXT + TEXT.replace("cube", "twin"),
    "cube.obj": OBJ,
    "tabs.obj": OBJ.replace(" ", "\t").replace("v", "  v"),
    "colours.obj": OBJ.replace("\nf 1 3 2", " 0.1 0.2 0.3\nvn 0 0 1\nvt 0 0\nusemtl m\nf 1/1/1 3//1 2/1"),
    "back.obj": OBJ.replace("f 1 3 2", "f -8 -6 -7") + "v 5 5 5\nv 6 6 6\n",
    "first.obj": OBJ[OBJ.index("f ") :] + OBJ[: OBJ.index("f ")],
    "groups.obj": "# x\no name\ng a\n" + OBJ.replace("1.0", "1e0").replace("\nf", "\ng b\nf", 1),
    "late.obj": OBJ.replace("f 2 3 4", "o late\nvn 0 0 1\nusemtl v\nf 2 3 4"),
    "mark.obj": "\ufeff" + OBJ,
    "quads.obj": OBJ[: OBJ.index("f ")] + "f 1 2 4 3\nf 5 7 \\\n8 6\nf 1 5 6 2\nf 3 4 8\nf 3 8 7\n",
    "cube.dae": DAE,
    "count.dae": DAE.replace('count="12"', 'count="1000000"'),
    "space.dae": re.sub(' xmlns="[^"]*"', "", DAE),
    "scene.dae": re.sub("<scene>.*</scene>", "", DAE),
    "normals.dae": DAE.replace(
        'offset="0"/>', 'offset="0"/><input semantic="NORMAL" source="#gone" offset="0"/>'
    ),
    "material.dae": DAE.replace(
        '<instance_geometry url="#g"/>',
        '<instance_camera url="#c"/><instance_geometry url="#g"><bind_material><technique_common>'
        '<instance_material symbol="m" target="#gone"/></technique_common></bind_material>'
        "</instance_geometry>",
    ),
    "polylist.dae": POLYLIST,
    "library.dae": library(),
}
ILL = {
    "none.stl": (bytes(84), "cut short or damaged"),
    "cut.stl": (binary_stl()[:-10], "cut short or damaged"),
    "empty.stl": ("solid nothing\nendsolid", "three vertices"),
    "large.stl": (TEXT.replace("-1.0", "1e99", 1), r"a vertex lies at 1e\+99 -1 -1"),
    "word.stl": (TEXT.replace("-1.0", "x", 1), "line 4: a vertex: 'x' is not a number"),
    "short.stl": (TEXT.replace("-1.0 ", "", 1), "line 4: a vertex must hold 3 numbers"),
    "inf.stl": (binary_stl().replace(b"\0\0\x80\xbf", b"\0\0\x80\x7f", 1), "a vertex lies at inf"),
    "empty.obj": ("", "the file is empty"),
    "words.obj": ("no mesh at all", "it holds no faces"),
    "points.obj": (OBJ[: OBJ.index("f ")], "it holds no faces"),
    "faces.obj": ("f 1 2 3\n", "line 1: a face names vertex 3 of 0"),
    "beyond.obj": (OBJ + "f 1 2 9\n", "line 21: a face names vertex 9 of 8"),
    "before.obj": (OBJ + "f 1 2 -9\n", "line 21: a face names vertex -9 of 8"),
    "zero.obj": (OBJ + "f 0 1 2\n", "line 21: a face names vertex 0 of 8"),
    "corner.obj": (OBJ + "f 1 2 x/1\n", "line 21: 'x/1' is not a corner"),
    "edge.obj": (OBJ + "f 1 2\n", "line 21: a face has 2 corners"),
    "flat.obj": ("v 1 2\n" + OBJ, "line 1: a vertex must hold 3 numbers"),
    "nan.obj": ("v 1 2 nan\n" + OBJ, "line 1: a vertex: 'nan' is not finite"),
    "point.obj": ("v 1 2 3\nf 1 1 1\n", "nothing to touch"),
    "broken.dae": ("<COLLADA><asset>", "not well-formed"),
    "rubbish.dae": (bytes(range(256)), "byte 128 is not valid utf-8"),
    "other.dae": ("<svg/>", "it is not COLLADA"),
    "empty.dae": ("<COLLADA/>", "it shows nothing: it has no <visual_scene>"),
    "beyond.dae": (DAE.replace("<p>0", "<p>8"), "beyond the limits of the source"),
    "below.dae": (DAE.replace("<p>0", "<p>-1"), "geometry 'g': a <p> holds something that isn't an index"),
    "source.dae": (DAE.replace('source id="p"', 'source id="q"'), "the source 'p' of its positions is"),
    "p.dae": (re.sub("<p>.*</p>", "", DAE), "Missing index"),
    "ids.dae": (re.sub(r'\sid="\w+"', "", DAE), "the source 'p' of its positions is"),
    "self.dae": (DAE.replace('"POSITION" source="#p"', '"POSITION" source="#v"'), "source 'v' .* is missing"),
    "three.dae": (
        DAE.replace('count="12"', 'count="1000000"').replace(POSITIONS, "0 0 0"), "nothing to touch"
    ),
    "half.dae": (DAE.replace(POSITIONS, "0 1 2 3"), "it can't be read: cannot reshape array of size 4"),
    "huge.dae": (DAE.replace(">-1.0", ">1e99"), "no coordinate may be beyond"),
    "nan.dae": (DAE.replace(">-1.0", ">nan"), "source 'p' holds something that isn't a number"),
    "unit.dae": (DAE.replace('meter="1"', 'meter="0"'), "<unit meter>"),
    "offset.dae": (DAE.replace('offset="0"', 'offset="99999999"'), "it can't be read: cannot reshape"),
    "vcount.dae": (POLYLIST.replace("4 4 4 4 4 4", "900000000 4"), "it can't be read: Unable to allocate"),
    "itself.dae": (
        library().replace(b'<node id="l">', b'<node id="l"><instance_node url="#l"/>'),
        "it can't be read: Node #l not found",
    ),
    "scene.dae": (re.sub("<library_visual.*</scene>", "", DAE, flags=re.DOTALL), "it has no <visual_scene>"),
}  # fmt: skip


def written(folder, name, data):
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


@pytest.mark.parametrize("name", WELL)
def test_a_cube_is_a_cube_in_every_kind_of_file(tmp_path, name):
    mesh = read_mesh(written(tmp_path, name, WELL[name]))
    corners = mesh.vertices[mesh.faces]
    assert np.unique(mesh.vertices, axis=0) == pytest.approx(CUBE)
    assert corners.shape[1:] == (3, 3)
    a, b, c = np.moveaxis(corners, 1, 0)
    sides = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    area = {"solids.stl": 48.0, "quads.obj": 16.0}.get(name, 24.0)
    assert sides.sum() / 2 == pytest.approx(area)


@pytest.mark.parametrize("name", ILL)
def test_what_is_damaged_is_named_in_one_line(tmp_path, name):
    data, fault = ILL[name]
    with pytest.raises(DescriptionError, match=rf"^mesh '.*{name}': .*{fault}") as raised:
        read_mesh(written(tmp_path, name, data))
    assert "\n" not in str(raised.value)


def test_collada_follows_its_nodes_and_unit_but_not_its_axis(tmp_path):
    """As Gazebo and RViz do: the file says that y is up."""
    # (2 0 0) turns to (0 2 0), (0 4 0) to (-4 0 0), (0 0 6) is twice as high; a unit is half a metre.
    wanted = [(0.5, 0, 0), (0.5, 1, 0), (-1.5, 0, 0), (0.5, 0, 6)]
    mesh = read_mesh(written(tmp_path, "a.dae", NODES))
    assert np.unique(mesh.vertices.round(6), axis=0) == pytest.approx(np.array(sorted(wanted)))


def test_an_index_that_counts_back_counts_from_its_own_line(tmp_path):
    corners = "v {0} 0 0\nv {0} 1 0\nv {0} 0 1\nf -3 -2 -1\n"
    mesh = read_mesh(written(tmp_path, "a.obj", corners.format(1) + corners.format(2)))
    assert mesh.vertices[mesh.faces][:, :, 0].tolist() == [[1, 1, 1], [2, 2, 2]]


@pytest.mark.slow
def test_nodes_that_show_each_other_ten_times_over_do_not_fill_the_memory(tmp_path, monkeypatch):
    levels = "".join(
        f'<node id="l{level + 1}">' + f'<instance_node url="#l{level}"/>' * 10 + "</node>"
        for level in range(8)
    )
    text = library().decode().replace('id="l"', 'id="l0"').replace('#l"', '#l8"')
    path = written(tmp_path, "a.dae", text.replace("</library_nodes>", f"{levels}</library_nodes>"))
    monkeypatch.setattr(meshes._process, "_limits", Limits(1, 60.0, 1 << 30, 1 << 20))
    meshes._process.close()
    with pytest.raises(DescriptionError, match="of processor time|of memory"):
        read_mesh(path)


@pytest.mark.parametrize("name", ["cube.stl", "text.stl", "cube.obj", "cube.dae"])
def test_a_file_has_bounds(tmp_path, monkeypatch, name):
    path = written(tmp_path, name, WELL[name])
    monkeypatch.setattr(mesh_program, "MOST_TRIANGLES", 11)
    with pytest.raises(DescriptionError, match="it has more than 11 triangles"):
        mesh_program.load(path)
    monkeypatch.setattr(meshes, "MOST_BYTES", 100)
    with pytest.raises(DescriptionError, match="it has more than 100 bytes"):
        mesh_program.load(path)


def test_meshes_are_equal_by_what_they_hold(tmp_path):
    one, same, other = (
        read_mesh(written(tmp_path, name, data))
        for name, data in (("a.obj", OBJ), ("b.obj", "# the same\n" + OBJ), ("c.stl", TEXT))
    )
    assert one == same
    assert hash(one) == hash(same)
    assert one != other


def directions(count, seed):
    """Points on the unit ball."""
    drawn = np.random.default_rng(seed).normal(size=(count, 3))
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)


def test_a_hull_of_very_many_corners_is_cut_down_by_next_to_nothing():
    """A ball of 20,000 points: seen from any side it stays as it is, to a thousandth of its radius."""
    ball, sides = directions(20_000, 0) * [[3.0, 2.0, 1.0]], directions(300, 1)
    hull = hull_points(ball)
    assert len(hull) <= MOST_POINTS
    lost = (ball @ sides.T).max(axis=0) - (hull @ sides.T).max(axis=0)
    assert 0.0 <= lost.max() < 0.006


@pytest.mark.parametrize("scale, place", [((1.0, 1.0, 1.0), 1e6), ((1.0, 1.0, 1e-6), 0.0)])
def test_a_hull_far_from_the_origin_and_one_of_a_thin_plate_keep_their_corners(scale, place):
    inside = np.random.default_rng(0).uniform(-0.5, 0.5, (MOST_POINTS, 3))
    corners = directions(1000, 0) * scale + place
    assert np.array_equal(hull_points(np.concatenate([corners, inside * scale + place])), corners)


def test_points_inside_of_a_hull_go_only_where_there_are_very_many():
    inside = np.random.default_rng(0).uniform(-1.0, 1.0, (MOST_POINTS, 3))
    points = np.concatenate([inside, CUBE])
    assert hull_points(points) == pytest.approx(CUBE)
    assert len(hull_points(points[-1000:])) == 1000
    flat = np.concatenate([inside, inside[:100] + 0.001]) * (1.0, 1.0, 0.0)
    assert 3 <= len(hull_points(flat)) <= MOST_POINTS
