"""The cart-pole's description has the figures of the real robot, in both of its files."""

import xml.etree.ElementTree as ElementTree

import pytest
import xacro
import yaml

FIGURES = {  # mass [kg], height of the centre of mass [m], ixx, iyy, izz [kg m²]
    "stand": (1.0356, 0.078463, 0.00182223142735174, 0.097952048263061, 0.0962757383045765),
    "cart": (0.11377, 0.00084171, 4.1669682348633e-05, 0.0001144665328628, 0.000111738946564849),
    "pole": (0.23243, 0.25293, 0.00438754518582167, 0.00438769663550614, 1.79012590972362e-05),
}
JOINTS = {  # type, parent, child, origin [m], axis; lower, upper [m, rad], effort [N, N m], velocity
    "grounding": ("fixed", "world", "stand", "0 0 0", None, None),
    "stand_cart": ("prismatic", "stand", "cart", "0 0 0.150", "1 0 0", (-0.5, 0.5, 30.0, 7.0)),
    "cart_pole": (*("continuous", "cart", "pole", "0 0 0.030", "0 -1 0"), (-0.785398, 0.785398, 30.0, 7.0)),
}
FILES = ["urdf/cartpole.urdf.xacro", "companions/cartpole_gazebo/robots/cartpole_v1.urdf"]
CONTROLLER = {"type": "effort_controllers/JointPositionController", "pid": {"p": 100.0, "i": 0.01, "d": 10.0}}


@pytest.fixture(scope="module")
def robots(root):
    return [ElementTree.fromstring(xacro.process_file(str(root / path)).toxml()) for path in FILES]


def numbers(text):
    return [float(word) for word in text.split()]


def test_both_files_are_one_robot(robots):
    one, other = robots
    assert [*map(ElementTree.tostring, one)] == [*map(ElementTree.tostring, other)]


def test_links(robots):
    robot = robots[0]
    assert [link.get("name") for link in robot.iter("link")] == ["world", *FIGURES]
    for name, (mass, height, *moments) in FIGURES.items():
        inertial = robot.find(f"link[@name='{name}']/inertial")
        assert float(inertial.find("mass").get("value")) == mass
        assert numbers(inertial.find("origin").get("xyz")) == [0.0, 0.0, height]
        assert numbers(inertial.find("origin").get("rpy")) == [0.0, 0.0, 0.0]
        found = [float(inertial.find("inertia").get(f"i{axes}")) for axes in
                 ("xx", "yy", "zz", "xy", "xz", "yz")]  # fmt: skip
        assert found == [*moments, 0.0, 0.0, 0.0]


def test_joints(robots):
    robot = robots[0]
    assert [joint.get("name") for joint in robot.findall("joint")] == list(JOINTS)
    for name, (kind, parent, child, origin, axis, limits) in JOINTS.items():
        joint = robot.find(f"joint[@name='{name}']")
        ends = (joint.find("parent").get("link"), joint.find("child").get("link"))
        assert (joint.get("type"), *ends) == (kind, parent, child)
        assert numbers(joint.find("origin").get("xyz")) == numbers(origin)
        assert numbers(joint.find("origin").get("rpy")) == [0.0, 0.0, 0.0]
        assert joint.find("dynamics") is None  # neither damping nor friction
        if limits is None:
            continue
        assert numbers(joint.find("axis").get("xyz")) == numbers(axis)
        limit = joint.find("limit")
        keys = ("lower", "upper", "effort", "velocity")
        assert tuple(float(limit.get(key)) for key in keys) == limits
        transmission = robot.find(f"transmission/joint[@name='{name}']/..")
        assert transmission.findtext("type") == "transmission_interface/SimpleTransmission"
        interface = transmission.findtext("joint/hardwareInterface")
        assert interface == "hardware_interface/EffortJointInterface"
        assert transmission.find("actuator").get("name")
        assert float(transmission.findtext("actuator/mechanicalReduction")) == 1.0


def test_plugin(robots):
    (plugin,) = robots[0].iter("plugin")
    assert plugin.get("filename") == "libgazebo_ros_control.so"
    assert plugin.find("robotNamespace") is None  # it would move the controllers' names


def test_shapes_are_primitive_and_the_pole_clears_the_stand(robots):
    """The pole swings in the plane y = 0; no part of the stand reaches into its width."""
    robot = robots[0]
    shapes = {shape.tag for geometry in robot.iter("geometry") for shape in geometry}
    assert shapes <= {"box", "cylinder", "sphere"}
    pole = robot.find("link[@name='pole']/collision/geometry/cylinder")
    assert float(pole.get("length")) == 0.5
    for collision in robot.findall("link[@name='stand']/collision"):
        y = numbers(collision.find("origin").get("xyz"))[1]
        width = numbers(collision.find("geometry/box").get("size"))[1]
        assert abs(y) - width / 2 > float(pole.get("radius"))


def test_controllers(root):
    path = root / "companions/cartpole_controller/config/joint_position_control.yaml"
    assert yaml.safe_load(path.read_text()) == {
        "joint_state_controller": {
            "type": "joint_state_controller/JointStateController",
            "publish_rate": 120,
        },
        "stand_cart_position_controller": {**CONTROLLER, "joint": "stand_cart"},
        "cart_pole_position_controller": {**CONTROLLER, "joint": "cart_pole"},
    }
