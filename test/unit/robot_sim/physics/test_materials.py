"""Gazebo's own materials, by their names in SDF and URDF."""

import pytest

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf

BOX = "<geometry><box>{}</box></geometry>"
RED, GREEN, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)
UNKNOWN = "the colour of material 'mine/Own' is not known"


def sdf(*materials):
    box = BOX.format("<size>1 1 1</size>")
    visuals = "".join(
        f'<visual name="{number}">{box}<material>{each}</material></visual>'
        for number, each in enumerate(materials)
    )
    text = f'<sdf version="1.6"><model name="m"><link name="l">{visuals}</link></model></sdf>'
    model = parse_sdf(text)
    return [shape.rgba for shape in model.links["l"].visuals], model.warnings


def script(name):
    uri = "<uri>file://media/materials/scripts/gazebo.material</uri>"
    return f"<script>{uri}<name>{name}</name></script>"


def urdf(*blocks):
    box = '<geometry><box size="1 1 1"/></geometry>'
    blue = '<material name="b"><color rgba="0 0 1 1"/></material>'
    inertial = """<inertial><mass value="1"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
    text = f"""<robot name="m"><link name="l">{inertial}
      <visual>{box}{blue}</visual><visual>{box}</visual></link>{"".join(blocks)}</robot>"""
    model = parse_urdf(text)
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


def test_a_colour_in_the_same_material_goes_before_its_script():
    assert sdf(script("Gazebo/Red") + "<diffuse>0 1 0 1</diffuse>") == ([GREEN], [])


def test_the_last_block_of_a_link_counts_and_its_value_may_be_an_attribute():
    blocks = [f'<gazebo reference="l">{each}</gazebo>' for each in (
        "<material>Gazebo/Red</material>", '<material value=" Gazebo/Green "/>')]  # fmt: skip
    assert urdf(*blocks) == ([GREEN, GREEN], [])


def test_an_unknown_material_leaves_the_colour_and_is_one_warning():
    assert sdf(script("mine/Own"), script("mine/Own")) == ([None, None], [UNKNOWN])
    block = '<gazebo reference="l"><material>mine/Own</material></gazebo>'
    assert urdf(block) == ([BLUE, None], [UNKNOWN])
