"""Pictures of mesh files with colours and textures, of what light passes through, and of mirrored meshes."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.mutations import mesh_files

from robot_sim.physics.description import Shape
from robot_sim.physics.pose import Pose
from robot_sim.pictures.camera import Camera
from robot_sim.pictures.renderer import Renderer

WIDTH, HEIGHT = 120, 120
CAMERA = Camera(target=(0.0, 0.0, 5.0), distance=4.0, yaw=0.0, pitch=0.0)  # looks along +y
# A square of 2 m that faces -y, its lower left corner at the texture's lower left one.
SQUARE = """mtllib looks.mtl
v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl front
f 1/1 2/2 3/3\nf 1/1 3/3 4/4
"""
TWO = """mtllib looks.mtl
v -1 0 -1\nv 0 0 -1\nv 0 0 1\nv -1 0 1\nv 1 0 -1\nv 1 0 1
usemtl left\nf 1 2 3 4
usemtl right\nf 2 5 6 3
"""


@pytest.fixture
def scene():
    made = Renderer()
    yield made
    made.close()


def seen(scene: Renderer) -> np.ndarray:
    return scene.picture(CAMERA, WIDTH, HEIGHT).astype(int)


def put(scene: Renderer, name: str, shape: Shape, y: float = 0.0) -> None:
    scene.add(name, [("link", shape)])
    scene.place(name, {"link": Pose((0.0, y, 5.0))})


def mesh(path: Path, text: str, size=(1.0, 1.0, 1.0), rgba=None) -> Shape:
    path.write_text(text)
    return Shape("mesh", size, mesh=str(path), rgba=rgba)


def main_colour(pixel: np.ndarray) -> str:
    names = {"r": (1, 0, 0), "g": (0, 1, 0), "b": (0, 0, 1), "y": (1, 1, 0)}
    bright = pixel > 0.5 * pixel.max()
    return next((name for name, each in names.items() if (bright == each).all()), "?")


def quarters(picture: np.ndarray) -> str:
    """Colours at the upper left, upper right, lower left and lower right of the middle."""
    low, high = HEIGHT // 2 - 12, HEIGHT // 2 + 12
    return "".join(main_colour(picture[y, x]) for y in (low, high) for x in (low, high))


def textured(folder: Path) -> str:
    image = np.zeros((8, 8, 3), np.uint8)
    image[:4, :4], image[:4, 4:] = (255, 0, 0), (0, 255, 0)
    image[4:, :4], image[4:, 4:] = (0, 0, 255), (255, 255, 0)
    Image.fromarray(image).save(folder / "image.png")
    (folder / "looks.mtl").write_text("newmtl front\nKd 1 1 1\nmap_Kd image.png\n")
    return SQUARE


def test_a_texture_is_seen_where_the_file_puts_it_as_bright_as_its_image(scene, tmp_path):
    text = textured(tmp_path)
    put(scene, "it", mesh(tmp_path / "square.obj", text))
    told = seen(scene)
    assert quarters(told) == "rgby"
    (tmp_path / "looks.mtl").write_text("newmtl front\nmap_Kd image.png\n")  # without a colour
    put(scene, "it", mesh(tmp_path / "other.obj", text))
    assert np.array_equal(seen(scene), told)


def test_a_texture_repeats(scene, tmp_path):
    text = textured(tmp_path).replace("vt 1", "vt 2").replace("1\nvt 0 1", "2\nvt 0 2")
    put(scene, "it", mesh(tmp_path / "square.obj", text))
    picture = seen(scene)
    at = [HEIGHT // 2 + each for each in (-32, -10, 10, 32)]
    assert [main_colour(picture[at[0], x]) for x in at] == ["r", "g", "r", "g"]


def test_materials_of_one_file_have_their_colours_and_those_of_the_robots_file_give_way(scene, tmp_path):
    (tmp_path / "looks.mtl").write_text("newmtl left\nKd 1 0 0\nnewmtl right\nKd 0 0 1\n")
    put(scene, "it", mesh(tmp_path / "two.obj", TWO, rgba=(0.0, 1.0, 0.0, 1.0)))
    assert quarters(seen(scene)) == "rbrb"


def test_a_file_without_looks_has_the_robots_files_colour(scene, tmp_path):
    plain = SQUARE.replace("mtllib looks.mtl\n", "").replace("usemtl front\n", "")
    put(scene, "it", mesh(tmp_path / "square.obj", plain, rgba=(0.0, 1.0, 0.0, 1.0)))
    assert quarters(seen(scene)) == "gggg"


def test_the_colours_of_a_collada_file(scene, tmp_path):
    looks = """<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert><diffuse>
      <color>0 0 1 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
      <library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>"""
    bound = """<instance_geometry url="#g"><bind_material><technique_common>
      <instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry>"""
    text = mesh_files.dae(unit="0.5", up="Y_UP").decode()
    text = text.replace("<library_geometries>", f"{looks}<library_geometries>")
    text = text.replace('<triangles count="12">', '<triangles count="12" material="s">')
    text = text.replace('<instance_geometry url="#g"/>', bound)
    put(scene, "it", mesh(tmp_path / "cube.dae", text, rgba=(1.0, 0.0, 0.0, 1.0)))
    picture = seen(scene)
    assert quarters(picture) == "bbbb"
    blue = picture[..., 2] > 2 * picture[..., 0]
    plain = tmp_path / "plain.dae"
    put(scene, "it", mesh(plain, mesh_files.dae("0.5", "Y_UP").decode(), rgba=(0, 0, 1, 1)))
    other = seen(scene)
    assert np.array_equal(blue, other[..., 2] > 2 * other[..., 0])  # the unit


@pytest.mark.parametrize(
    ("size", "expected"),
    [((-1.0, 1.0, 1.0), "gryb"), ((1.0, 1.0, -1.0), "byrg"), ((-0.5, -1.0, -1.0), "????")],
)
def test_a_mirrored_mesh_is_seen_from_the_same_side(scene, tmp_path, size, expected):
    """Its triangles go round the other way, and are turned back."""
    put(scene, "it", mesh(tmp_path / "square.obj", textured(tmp_path), size))
    assert quarters(seen(scene)) == expected


def test_light_passes_through_what_is_half_transparent(scene):
    box = (1.0, 0.2, 1.0)
    put(scene, "behind", Shape("box", box, rgba=(0.0, 1.0, 0.0, 1.0)), 1.0)
    alone = seen(scene)[60, 60]
    put(scene, "clear", Shape("box", box, rgba=(1.0, 0.0, 0.0, 0.5)))
    through = seen(scene)
    put(scene, "clear", Shape("box", box, rgba=(1.0, 0.0, 0.0, 1.0)))
    whole = seen(scene)
    assert through[60, 60] == pytest.approx((alone + whole[60, 60]) / 2.0, abs=2.0)
    edge = np.argmax(whole[60, :, 1] < 100)  # the nearer box is seen on both sides of the other one
    scene.remove("clear")
    scene.remove("behind")
    sky = seen(scene)[60, edge + 2]
    assert through[60, edge + 2] == pytest.approx((whole[60, edge + 2] + sky) / 2.0, abs=2.0)


def test_what_is_whole_hides_what_is_half_transparent(scene):
    box = (1.0, 0.2, 1.0)
    put(scene, "whole", Shape("box", box, rgba=(0.0, 1.0, 0.0, 1.0)))
    before = seen(scene)
    put(scene, "clear", Shape("box", (0.9, 0.2, 0.9), rgba=(1.0, 0.0, 0.0, 0.5)), 1.0)
    assert np.array_equal(seen(scene), before)


def test_a_damaged_texture_leaves_the_shape(scene, tmp_path):
    text = textured(tmp_path)
    (tmp_path / "image.png").write_bytes(b"no image")
    put(scene, "it", mesh(tmp_path / "square.obj", text, rgba=(0.0, 0.0, 1.0, 1.0)))
    picture = seen(scene)
    assert (np.abs(picture[60, 60] - picture[5, 5]) > 20).any()
