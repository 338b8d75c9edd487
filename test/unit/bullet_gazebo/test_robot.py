"""The robot has the figures of the real one, exactly."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest
import xacro
import yaml

FIGURES = {  # mass [kg], height of the centre of mass [m], ixx, iyy, izz [kg m^2]
    "stand": (1.0356, 0.078463, 0.00182223142735174, 0.097952048263061, 0.0962757383045765),
    "cart": (0.11377, 0.00084171, 4.1669682348633e-05, 0.0001144665328628, 0.000111738946564849),
    "pole": (0.23243, 0.25293, 0.00438754518582167, 0.00438769663550614, 1.79012590972362e-05),
}
JOINTS = {  # type, parent, child, origin [m], axis
    "grounding": ("fixed", "world", "stand", [0, 0, 0], None),
    "stand_cart": ("prismatic", "stand", "cart", [0, 0, 0.150], [1, 0, 0]),
    "cart_pole": ("continuous", "cart", "pole", [0, 0, 0.030], [0, -1, 0]),
}
LIMITS = {  # lower, upper [m or rad], effort [N or N m], velocity [m/s or rad/s]
    "stand_cart": (-0.5, 0.5, 30, 7),
    "cart_pole": (-0.785398, 0.785398, 30, 7),
}
EFFORT = "hardware_interface/EffortJointInterface"


def expand(path):
    return ElementTree.fromstring(xacro.process_file(str(path)).toxml())


def numbers(element, attribute):
    return [float(word) for word in element.get(attribute).split()]


@pytest.fixture(
    scope="module",
    params=["urdf/cartpole.urdf.xacro", "companions/cartpole_gazebo/robots/cartpole_v1.urdf"],
)
def robot(request, root):
    return expand(root / request.param)


def test_links(robot):
    assert [link.get("name") for link in robot.iter("link")] == ["world", *FIGURES]


@pytest.mark.parametrize("name", FIGURES)
def test_inertia(robot, name):
    mass, com, *moments = FIGURES[name]
    inertial = robot.find(f"link[@name='{name}']/inertial")
    assert float(inertial.find("mass").get("value")) == mass
    assert numbers(inertial.find("origin"), "xyz") == [0, 0, com]
    assert numbers(inertial.find("origin"), "rpy") == [0, 0, 0]
    inertia = inertial.find("inertia")
    assert [float(inertia.get(key)) for key in ("ixx", "iyy", "izz")] == moments
    assert [float(inertia.get(key)) for key in ("ixy", "ixz", "iyz")] == [0, 0, 0]


def test_joints(robot):
    assert [joint.get("name") for joint in robot.findall("joint")] == list(JOINTS)


@pytest.mark.parametrize("name", JOINTS)
def test_joint(robot, name):
    kind, parent, child, origin, axis = JOINTS[name]
    joint = robot.find(f"joint[@name='{name}']")
    assert joint.get("type") == kind
    assert joint.find("parent").get("link") == parent
    assert joint.find("child").get("link") == child
    assert numbers(joint.find("origin"), "xyz") == origin
    assert numbers(joint.find("origin"), "rpy") == [0, 0, 0]
    if axis:
        assert numbers(joint.find("axis"), "xyz") == axis
    assert joint.find("dynamics") is None, "the joints have neither damping nor friction"


@pytest.mark.parametrize("name", LIMITS)
def test_limits(robot, name):
    limit = robot.find(f"joint[@name='{name}']/limit")
    found = tuple(float(limit.get(key)) for key in ("lower", "upper", "effort", "velocity"))
    assert found == LIMITS[name]


@pytest.mark.parametrize("name", LIMITS)
def test_transmission(robot, name):
    transmission = robot.find(f"transmission/joint[@name='{name}']/..")
    assert transmission.findtext("type") == "transmission_interface/SimpleTransmission"
    assert transmission.findtext("joint/hardwareInterface") == EFFORT
    assert transmission.find("actuator").get("name")
    assert float(transmission.findtext("actuator/mechanicalReduction")) == 1


def test_plugin(robot):
    (plugin,) = robot.iter("plugin")
    assert plugin.get("filename") == "libgazebo_ros_control.so"
    assert plugin.find("robotNamespace") is None, "it would move the controllers' names"


def test_pole_is_half_a_metre(robot):
    cylinder = robot.find("link[@name='pole']/collision/geometry/cylinder")
    assert float(cylinder.get("length")) == 0.5


def test_shapes_are_primitive(robot):
    shapes = {shape.tag for geometry in robot.iter("geometry") for shape in geometry}
    assert shapes <= {"box", "cylinder", "sphere"}


def test_pole_clears_the_stand(robot):
    """The pole swings in the plane y = 0; no part of the stand reaches into its width."""
    radius = float(robot.find("link[@name='pole']/collision/geometry/cylinder").get("radius"))
    for collision in robot.findall("link[@name='stand']/collision"):
        y = numbers(collision.find("origin"), "xyz")[1]
        width = numbers(collision.find("geometry/box"), "size")[1]
        assert abs(y) - width / 2 > radius


def test_both_files_are_one_robot(root):
    ours, theirs = (
        expand(root / path)
        for path in (
            "urdf/cartpole.urdf.xacro",
            "companions/cartpole_gazebo/robots/cartpole_v1.urdf",
        )
    )
    for part, other in zip(ours, theirs, strict=True):
        assert ElementTree.tostring(part) == ElementTree.tostring(other)


def test_controllers(root):
    path = root / "companions/cartpole_controller/config/joint_position_control.yaml"
    gains = {"p": 100.0, "i": 0.01, "d": 10.0}
    kind = "effort_controllers/JointPositionController"
    assert yaml.safe_load(path.read_text()) == {
        "joint_state_controller": {
            "type": "joint_state_controller/JointStateController",
            "publish_rate": 120,
        },
        "stand_cart_position_controller": {"type": kind, "joint": "stand_cart", "pid": gains},
        "cart_pole_position_controller": {"type": kind, "joint": "cart_pole", "pid": gains},
    }
