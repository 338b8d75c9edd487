"""The table of elements has what the schemas have, and a warning names what has no effect."""

import re
from xml.etree import ElementTree

import pytest
from support.element_documents import SCHEMAS, documents, every_path, in_urdf, schema_paths, urdf_paths
from support.robots.snippets import box, collision, link, robot, sdf, sdf_link, sdf_world

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.element_table import BY_DESIGN, READ, WARNED, WithoutEffect, element_table
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.files.world_file import parse_world

VERSIONS = ("1.4", "1.5", "1.6", "1.7")
NEWER = ("1.8", "1.9")  # have shapes that Gazebo 11's schemas lack
NEEDS_SCHEMAS = pytest.mark.skipif(
    not SCHEMAS.is_dir(), reason="SDF's schemas are missing: apt-get install libsdformat-dev"
)
# Of sdformat's parser of URDF; elements that Gazebo's SDF has are put into the model as they are.
EXTENSIONS = (
    "canonicalBody", "cfmDamping", "dampingFactor", "disableFixedJointLumping", "fdir1",
    "fudgeFactor", "gravity", "implicitSpringDamper", "initialJointPosition",
    "initial_joint_position", "kd", "kp", "laserRetro", "material", "maxContacts", "maxVel",
    "minDepth", "mu1", "mu2", "preserveFixedJoint", "provideFeedback", "selfCollide",
    "self_collide", "soft_cfm", "soft_erp", "springReference", "springStiffness", "static",
    "stopCfm", "stopErp", "stopKd", "stopKp", "turnGravityOff",
)  # fmt: skip
AS_THEY_ARE = (
    "allow_auto_disable", "audio_source", "collision", "enable_wind", "frame", "gripper", "joint",
    "kinematic", "light", "link", "model", "plugin", "projector", "sensor",
    "velocity_decay/angular", "velocity_decay/linear", "visual", "@reference",
)  # fmt: skip
OF_ROS_CONTROL = (
    "actuator/hardwareInterface", "actuator/mechanicalReduction", "actuator/motorTorqueConstant",
    "actuator/role", "compensator", "joint/hardwareInterface", "joint/mechanicalReduction",
    "joint/offset", "joint/role", "motorTorqueConstant", "simulated_actuated_joint", "type",
)  # fmt: skip
BEYOND = ("@type", "bias_mean", "bias_stddev", "precision")  # lasers' noise may be any here


@NEEDS_SCHEMAS
@pytest.mark.parametrize("version", VERSIONS)
def test_each_element_and_attribute_of_sdf_has_a_row(version):
    found, missing = schema_paths(version)
    assert missing == [] and len(found) > 300


@NEEDS_SCHEMAS
def test_each_row_of_sdf_is_in_a_schema():
    found = {path for version in (*VERSIONS, *NEWER) for path in schema_paths(version)[0]}
    rows = {row for row in every_path(READ, WARNED, BY_DESIGN) if not in_urdf(row[0])}
    assert rows - found == {("ray", f"noise/{name}") for name in BEYOND}


def test_each_element_and_attribute_of_urdf_has_a_row_and_the_other_way_around():
    found, missing = urdf_paths()
    assert missing == []
    rows = {row for row in every_path(READ, WARNED, BY_DESIGN) if in_urdf(row[0])}
    others = {("gazebo", name) for name in (*EXTENSIONS, *AS_THEY_ARE)}
    others |= {("transmission", name) for name in OF_ROS_CONTROL} | {("value", "@value")}
    others |= {("robot", name) for name in ("gazebo", "origin/@xyz", "origin/@rpy")}
    others |= {("urdf_shape", name) for name in ("@group", "contact_coefficients")}
    assert rows - found == others


@NEEDS_SCHEMAS
def test_defaults_are_those_of_the_schema():
    found = {}
    for version in VERSIONS:
        for path, value in schema_paths(version)[0].items():
            found.setdefault(path, set()).add(value)
    for section, path in every_path(WARNED):
        default = element_table()[section].named[path].default
        if default and not in_urdf(section):
            values = {value.split("/")[-1] for value in default.split("|")}
            assert {plain(value) for value in found[section, path]} & set(map(plain, values)), path


def plain(text):
    """A value however it is written."""
    words = [{"true": "1", "false": "0"}.get(word, word) for word in text.replace(",", " ").split()]
    return tuple(float(word) if word[-1].isdigit() else word for word in words)


def warning_of(document):
    """The line about what has no effect; none if there is none, or the file is refused."""
    text = ElementTree.tostring(document)
    try:
        if document.tag == "robot":
            warnings = parse_urdf(text).warnings
        elif document.find("world") is not None:
            warnings = parse_world(text, Resources()).warnings
        else:
            warnings = parse_sdf(text).warnings
    except DescriptionError as error:
        return str(error)
    return next((line for line in warnings if "docs/files.md" in line), None)


def other_value(section, path):
    """A value that isn't the default."""
    default = element_table()[section].named[path].default
    return " ".join(["7"] * max(1, default.count(",") + 1)) if default else ""


def label(path):
    """What a line that names a row has."""
    last = path.split("/")[-1].lstrip("@")
    return re.compile(f"[< ]{last}[>:]")


@pytest.mark.parametrize(("section", "path"), every_path(WARNED))
def test_a_warning_names_what_has_no_effect(section, path):
    said = [warning_of(each) for each in documents(section, path, other_value(section, path))]
    assert any(label(path).search(line) for line in said if line), said


@pytest.mark.parametrize(("section", "path"), every_path(WARNED))
def test_values_that_are_defaults_have_no_warning(section, path):
    default = element_table()[section].named[path].default
    if default:
        first = default.split("|")[0].split("/")[-1].replace(",", " ")
        assert [warning_of(each) for each in documents(section, path, first)][:1] == [None]


@pytest.mark.parametrize(("section", "path"), every_path(READ, BY_DESIGN))
def test_nothing_is_said_of_other_elements(section, path):
    for document in documents(section, path, ""):
        unread = WithoutEffect()
        unread.look(document, document.tag)
        for model in (*document.findall("model"), *document.findall("world/model")):
            unread.look(model, "model")
        assert unread.warnings() == []


MODEL = """<sdf version="1.6" xmlns:custom="urn:else"><model name="m" custom:a="1">
<custom:parts><x/></custom:parts>{}<link name="l"/></model></sdf>"""
STIFF = "<surface><contact><ode><kp>1e6</kp><kd>{}</kd></ode></contact></surface>"
SHAPES = "".join(collision("<box/>", STIFF.format(kd), name) for name, kd in (("a", 1), ("b", 7)))
POSE = '<pose relative_to="{}">1 0 0 0 0 0</pose>'
SENSOR = '<link name="m"><sensor name="s" type="{}"/></link>'
TOLD = [  # of a model of SDF; its warnings
    (sdf(f'<model name="cart"><link name="wheel" color="red">{SHAPES}</link><joints/></model>',
         '<link name="l"><enable_wind>1</enable_wind><graviti>0</graviti></link>', static=True),
     # One line names each once, with its first place and how many there are.
     ["no effect here: <enable_wind> of link 'l', "
      "<kp> of model 'cart', link 'wheel', collision 'a' (and 1 more), "
      "<kd> of model 'cart', link 'wheel', collision 'b'; unknown: <graviti> of link 'l', "
      "<joints> of model 'cart', <link color> of model 'cart', link 'wheel' (docs/files.md)"]),
    *((sdf(SENSOR.format(kind)),
       ["no effect here: <sensor type> of link 'm', sensor 's' (docs/files.md)"])
      for kind in ("gps", "thermal_camera", "wireless_receiver", "rya")),
    (MODEL.format(""), []),  # names of other namespaces are for others
    (MODEL.format(POSE.format("table")), ["<pose>: it is the world's, not relative to 'table'"]),
    (MODEL.format(POSE.format("")), []),
    (MODEL.format(POSE.format("world")), []),
]  # fmt: skip


@pytest.mark.parametrize(("text", "told"), TOLD)
def test_what_has_no_effect_and_what_nobody_knows_is_told(text, told):
    assert parse_sdf(text).warnings == told


def test_a_world_has_a_line_of_its_own_and_each_model_too():
    text = sdf_world(
        "<wind><linear_velocity>1 0 0</linear_velocity></wind><models/>",
        '<physics type="ode"><ode><solver><type>world</type></solver></ode></physics>',
        '<model name="m"><link name="l"><enable_wind>true</enable_wind></link></model>',
    )
    found = parse_world(text, Resources())
    assert found.warnings == [
        "no effect here: <linear_velocity> of world 'w', <type> of world 'w', physics; "
        "unknown: <models> of world 'w' (docs/files.md)"
    ]
    told = "no effect here: <enable_wind> of link 'l' (docs/files.md)"
    assert found.models["m"].warnings == [told]


def test_a_urdf_names_its_blocks():
    extensions = """<gazebo reference="l"><kp>1e6</kp><mu1>0.2</mu1><mu2>0.2</mu2><fdir1/></gazebo>
    <gazebo reference="l"><mu1 value="0.3"/><mu2 value="0.2"/></gazebo>"""
    model = parse_urdf(robot(link("l", more="<visuals/>"), extensions))
    assert model.warnings == [
        "no effect here: <kp> of gazebo 'l', <mu2> of gazebo 'l'; unknown: <visuals> of link 'l' "
        "(docs/files.md)"
    ]


@pytest.mark.parametrize(
    ("friction", "warned"),
    [
        ("<{0}>0.3</{0}>", ["no effect here: <{0}> without <mu2>, which is 1, of {1}"]),
        ("<{0}>1.0</{0}>", []),
        ("<{0}>0.3</{0}><mu2>0.3</mu2>", []),
        ("<{0}>0.3</{0}><mu2>1</mu2>", ["no effect here: <mu2> of {1}"]),
        ("", []),
    ],
)
def test_a_friction_in_one_direction_alone_is_told(friction, warned):
    """Gazebo's other direction has 1."""
    shape = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    block = f'<gazebo reference="l">{friction.format("mu1")}</gazebo>'
    one = parse_urdf(robot(link("l", more=shape), block))
    surface = f"<surface><friction><ode>{friction.format('mu')}</ode></friction></surface>"
    other = parse_sdf(sdf(sdf_link("l", more=collision(box("1 1 1"), surface))))
    for model, name, place in ((one, "mu1", "gazebo 'l'"), (other, "mu", "link 'l', collision 'c'")):
        lines = [f"{each.format(name, place)} (docs/files.md)" for each in warned]
        assert model.warnings == lines


def test_the_line_is_bounded():
    many = "".join(f"<x{number}{'x' * 90}/>" for number in range(200))
    [line] = parse_sdf(MODEL.format(many)).warnings
    assert line.endswith(", and 190 other elements (docs/files.md)") and len(line) < 1100
