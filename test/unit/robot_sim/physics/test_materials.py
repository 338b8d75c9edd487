"""Gazebo's own materials, by their names in SDF and URDF."""

import pytest
from support.robots import snippets
from support.robots.snippets import box, link, robot, sdf_link

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf

RED, GREEN, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)
UNKNOWN = "the colour of material 'mine/Own' is not known"


def sdf(*materials):
    shape = f"<geometry>{box('1 1 1')}</geometry>"
    visuals = "".join(
        f'<visual name="{number}">{shape}<material>{each}</material></visual>'
        for number, each in enumerate(materials)
    )
    model = parse_sdf(snippets.sdf(sdf_link("l", more=visuals)))
    return [shape.rgba for shape in model.links["l"].visuals], model.warnings


def script(name):
    uri = "<uri>file://media/materials/scripts/gazebo.material</uri>"
    return f"<script>{uri}<name>{name}</name></script>"


def urdf(*blocks):
    shape = '<geometry><box size="1 1 1"/></geometry>'
    blue = '<material name="b"><color rgba="0 0 1 1"/></material>'
    visuals = f"<visual>{shape}{blue}</visual><visual>{shape}</visual>"
    model = parse_urdf(robot(link("l", more=visuals), *blocks))
    return [shape.rgba for shape in model.links["l"].visuals], model.warnings


@pytest.mark.parametrize(
    ("name", "rgba"),
    [
        ("Gazebo/Red", RED),
        ("Gazebo/Green", GREEN),
        ("Gazebo/SkyBlue", BLUE),
        ("Gazebo/DarkGrey", (0.175, 0.175, 0.175, 1.0)),
        ("Gazebo/BlueTransparent", (0.0, 0.0, 1.0, 0.5)),
    ],
)
def test_a_material_of_gazebos_has_its_colour(name, rgba):
    assert sdf(script(name)) == ([rgba], [])
    block = f'<gazebo reference="l"><material>{name}</material></gazebo>'
    assert urdf(block) == ([rgba, rgba], [])


def test_a_colour_goes_before_its_script_the_last_block_counts_and_may_have_an_attribute():
    assert sdf(script("Gazebo/Red") + "<diffuse>0 1 0 1</diffuse>") == ([GREEN], [])
    red, green = "<material>Gazebo/Red</material>", '<material value=" Gazebo/Green "/>'
    blocks = [f'<gazebo reference="l">{each}</gazebo>' for each in (red, green)]
    assert urdf(*blocks) == ([GREEN, GREEN], [])


def test_an_unknown_material_leaves_the_colour_and_is_one_warning():
    assert sdf(script("mine/Own"), script("mine/Own")) == ([None, None], [UNKNOWN])
    block = '<gazebo reference="l"><material>mine/Own</material></gazebo>'
    assert urdf(block) == ([BLUE, None], [UNKNOWN])
