"""Simple shapes for models of Gazebo's database, and for their meshes, where it isn't installed."""

import re
from copy import deepcopy
from functools import cache
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from robot_sim.physics.files.reading import Reading

OWN_MODELS = Path(__file__).with_name("models.sdf")
MESH = re.compile(r"model://([^/]+)/meshes/[^/]+")


@cache
def own_models() -> dict[str, Element]:
    """Returns the models of Gazebo's database that have a simple shape here, by their folders' names."""
    root = Reading().open(OWN_MODELS)
    for model in root.iterfind("model[@rgba]"):
        for link in model.findall("link"):
            for visual in map(deepcopy, link.findall("collision")):
                visual.tag = "visual"
                diffuse = SubElement(SubElement(visual, "material"), "diffuse")
                diffuse.text = model.get("rgba")
                link.append(visual)
    return {element.get("folder", ""): element for element in root}


def model_of_mesh(uri: str) -> Element | None:
    """Returns our own model of which Gazebo's has a mesh `uri`."""
    match = MESH.fullmatch(uri.strip())
    model = own_models().get(match[1]) if match else None
    return model if model is not None and model.get("rgba") and not model.get("exact") else None
