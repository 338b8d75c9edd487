"""Colours and textures of mesh files; the child process of `meshes` reads them.

Whatever is raised here over broken materials only leaves the mesh without them.
"""

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from file_access.xml_text import parse
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.elements import finite

if TYPE_CHECKING:
    import trimesh

MOST_TEXTURE = 32_000_000  # [bytes] of a model with its textures, for the browser
MOST_COLORS = 64  # of a mesh whose faces have colours of their own, for pictures
LARGEST_IMAGE = 1024  # [pixels] a side, for pictures
STOPGAP = 2  # [pixels] a side of the image by which trimesh replaces a missing one
WHITE = (255, 255, 255, 255)
NONE = np.zeros(0)
IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"


def read_glb(path: Path) -> bytes:
    """Returns the mesh with its materials as binary glTF; empty without materials, or if it is too large."""
    scene = _scene(path)
    content: bytes = b"" if scene is None else scene.export(file_type="glb")
    return content if len(content) <= MOST_TEXTURE else b""


def read_parts(path: Path) -> Iterator[np.ndarray]:
    """Yields four arrays for each colour or texture: the fields of `MeshPart`, empty for None."""
    scene = _scene(path)
    if scene is None:
        return
    for node in scene.graph.nodes_geometry:
        frame, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not hasattr(mesh, "faces"):
            continue  # lines and points
        points = mesh.vertices @ frame[:3, :3].T + frame[:3, 3]
        triangles, visual = points[mesh.faces], mesh.visual
        if np.linalg.det(frame[:3, :3]) < 0.0:
            triangles = triangles[:, ::-1]
        if visual.kind != "texture":
            for some, color in _by_color(np.asarray(visual.face_colors)):
                yield from (triangles[some], _rgba(color), NONE, NONE)
        elif _is_stopgap(visual.material):
            yield from (triangles, NONE, NONE, NONE)
        else:
            rgba, image = _color(visual.material), _image(visual.material)
            if image is None or visual.uv is None:
                yield from (triangles, rgba, NONE, NONE)
            else:
                yield from (triangles, rgba, image, np.asarray(visual.uv, float)[mesh.faces])


def _scene(path: Path) -> "trimesh.Scene | None":
    """Returns the file's scene (in metres) with its materials, or None if it has none."""
    import trimesh

    if path.suffix.lower() == ".dae":
        root = parse_collada(path.read_bytes())
        folder = trimesh.resolvers.FilePathResolver(str(path))
        scene = trimesh.load_scene(BytesIO(tostring(root)), file_type="dae", resolver=folder)
        scene.apply_scale(meters_of(root))
    else:
        scene = trimesh.load_scene(str(path))
    if not any(_has_look(part) for part in scene.geometry.values()):
        return None
    for part in scene.geometry.values():
        _brighten(getattr(getattr(part, "visual", None), "material", None))
    return scene


def meters_of(root: Element) -> float:
    """Returns the unit [m] of a COLLADA file. Its `<up_axis>` is not applied, as in Gazebo and RViz."""
    unit = root.find("asset/unit")
    meters = 1.0 if unit is None else finite(unit.get("meter", "1"), "<unit meter>")
    if not meters > 0.0:
        raise DescriptionError(f"<unit meter>: a unit of {meters} m has no length")
    return meters


def parse_collada(data: bytes) -> Element:
    """Returns the root of a COLLADA file whose scenes show skins in bind pose, as geometries of their own."""
    root = parse(data)
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    root.set("xmlns", "http://www.collada.org/2005/11/COLLADASchema")
    skins = {f"#{each.get('id')}": each.find("skin") for each in root.iter("controller")}
    for scene in root.findall("library_visual_scenes/visual_scene"):
        for instance in list(scene.iter("instance_controller")):
            skin = skins.get(instance.get("url", ""))
            if skin is not None:
                node = SubElement(scene, "node")
                SubElement(node, "matrix").text = skin.findtext("bind_shape_matrix", IDENTITY)
                geometry = SubElement(node, "instance_geometry", url=skin.get("source", ""))
                geometry.extend(instance)
    return root


def _has_look(part: object) -> bool:
    visual = getattr(part, "visual", None)
    if visual is None or not visual.defined:
        return False
    if visual.kind != "texture":
        return bool(visual.kind)
    return not _is_stopgap(visual.material)


def _is_stopgap(material: Any) -> bool:
    """Returns whether trimesh made this material up for a missing one."""
    image = getattr(material, "image", None)
    return getattr(material, "kwargs", None) == {} and (image is None or max(image.size) <= STOPGAP)


def _brighten(material: Any) -> None:
    """Shows a texture without a colour as it is; trimesh would darken it."""
    given = getattr(material, "kwargs", None)
    if given is not None and "kd" not in given and getattr(material, "image", None) is not None:
        material.diffuse = WHITE


def _by_color(colors: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields which faces have a colour, and the colour, of (n, 4) of uint8; many are reduced to a few."""
    palette, kinds = np.unique(colors, axis=0, return_inverse=True)
    if len(palette) > MOST_COLORS:
        coarse = (colors[:, :3] // 64).astype(int) @ (16, 4, 1)
        _, kinds = np.unique(coarse, return_inverse=True)
        palette = np.array([colors[kinds == kind].mean(axis=0) for kind in range(kinds.max() + 1)])
    for kind, color in enumerate(palette):
        yield kinds.ravel() == kind, color


def _color(material: Any) -> np.ndarray:
    for key in ("baseColorFactor", "diffuse"):
        value = getattr(material, key, None)
        if value is not None:
            return _rgba(value)
    return np.ones(4)


def _rgba(color: Any) -> np.ndarray:
    """Converts a trimesh colour: integers range from 0 to 255, floats from 0 to 1."""
    numbers = np.ravel(color)
    if len(numbers) < 3:
        raise ValueError("a colour has three numbers or four")
    scale = 255.0 if np.issubdtype(numbers.dtype, np.integer) or numbers.max() > 1.0 else 1.0
    return np.append(np.clip(numbers / scale, 0.0, 1.0), 1.0)[:4]


def _image(material: Any) -> np.ndarray | None:
    from PIL import Image

    for key in ("baseColorTexture", "image"):
        image = getattr(material, key, None)
        if isinstance(image, Image.Image):
            small = image.convert("RGB")
            small.thumbnail((LARGEST_IMAGE, LARGEST_IMAGE))
            return np.asarray(small)
    return None
