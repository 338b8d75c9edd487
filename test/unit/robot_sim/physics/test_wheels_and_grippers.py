"""Velocity and position joints against contacts: a robot on wheels, and a gripper around a box."""

import pytest
from support.robots.worlds import add_robot, start

from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.simulator import Simulator


def link(name, mass, shape, inertia, place="0 0 0", turn="0 0 0"):
    return f"""<link name="{name}"><inertial><origin xyz="{place}" rpy="{turn}"/><mass value="{mass}"/>
      <inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial>
      <collision><origin xyz="{place}" rpy="{turn}"/><geometry>{shape}</geometry></collision></link>"""


def joint(name, kind, interface, parent, origin, axis, limit):
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{name}_link"/>
      <origin xyz="{origin}"/><axis xyz="{axis}"/><limit {limit}/></joint>
      <transmission name="{name}_t"><type>transmission_interface/SimpleTransmission</type>
        <joint name="{name}"><hardwareInterface>hardware_interface/{interface}JointInterface
        </hardwareInterface></joint><actuator name="{name}_m"/></transmission>"""


def cart():
    """Two wheels of 0.1 m, 0.4 m apart, and smooth balls before and behind, 2 mm above the ground."""
    parts = [link("base", 5.0, '<box size="0.3 0.2 0.05"/>', 0.1)]
    for name, side in (("left", 0.2), ("right", -0.2)):
        wheel = '<cylinder radius="0.1" length="0.04"/>'
        parts.append(link(f"{name}_link", 1.0, wheel, 0.004, turn="1.5707963267948966 0 0"))
        limit = 'effort="10" velocity="20"'
        parts.append(joint(name, "continuous", "Velocity", "base", f"0 {side} 0", "0 1 0", limit))
    for name, ahead in (("front", 0.2), ("back", -0.2)):
        parts.append(link(name, 0.1, '<sphere radius="0.05"/>', 0.001))
        parts.append(f'<joint name="{name}_j" type="fixed"><parent link="base"/><child link="{name}"/>'
                     f'<origin xyz="{ahead} 0 -0.048"/></joint>'
                     f'<gazebo reference="{name}"><mu1>0</mu1><mu2>0</mu2></gazebo>')  # fmt: skip
    return f'<robot name="cart">{"".join(parts)}</robot>'


def gripper():
    """Two fingers that close along x, on a lift."""
    parts = ['<link name="world"/>', link("lift_link", 1.0, '<box size="0.02 0.02 0.02"/>', 0.01)]
    limit = 'lower="-1" upper="1" effort="500" velocity="0.5"'
    parts.append(joint("lift", "prismatic", "Position", "world", "0 0 0.5", "0 0 1", limit))
    for name, side in (("left", 1), ("right", -1)):
        parts.append(link(f"{name}_link", 0.1, '<box size="0.02 0.1 0.2"/>', 0.001))
        limit = 'lower="0" upper="0.1" effort="20" velocity="0.1"'
        place, axis = f"{side * 0.1} 0 -0.4", f"{-side} 0 0"
        parts.append(joint(name, "prismatic", "Position", "lift_link", place, axis, limit))
    return f'<robot name="gripper">{"".join(parts)}</robot>'


class Bench:
    """A robot on the ground, its joints under one group controller."""

    def __init__(self, world, text, pose, kind, joints, gains=None):
        self.sim = Simulator(world, lockstep=True)
        self.robot = add_robot(self.sim, "robot", text, pose, gains)
        start(self.robot, {"group": {"type": kind, "joints": joints}})

    def advance(self, seconds, *commands):
        self.robot.manager.get("group").command_all(commands)
        with self.sim.lock:
            self.sim.advance(round(1000 * seconds))


@pytest.mark.parametrize(("left", "right"), [(5.0, 5.0), (2.0, -2.0)])
def test_a_robot_drives_straight_and_turns_as_fast_as_its_wheels_say(world, left, right):
    kind = "velocity_controllers/JointGroupVelocityController"
    bench = Bench(world, cart(), Pose((0.0, 0.0, 0.1)), kind, ["left", "right"])
    bench.advance(0.5, 0.0, 0.0)
    bench.advance(0.5, left, right)
    before = bench.robot.model.state()[0].position
    bench.advance(4.0, left, right)
    (pose, (linear, angular)) = bench.robot.model.state()
    assert pose.position[0] - before[0] == pytest.approx(4.0 * 0.1 * (left + right) / 2, abs=0.01)
    assert pose.position[1] == pytest.approx(0.0, abs=0.01)
    assert angular[2] == pytest.approx(0.1 * (right - left) / 0.4, rel=0.1, abs=0.01)


def test_a_gripper_with_gains_holds_a_box_and_lifts_it(world):
    kind = "position_controllers/JointGroupPositionController"
    gains = {name: {"p": 2000.0, "d": 40.0} for name in ("left", "right")}
    bench = Bench(world, gripper(), Pose(), kind, ["left", "right", "lift"], gains)
    text = link("box", 0.5, '<box size="0.08 0.08 0.1"/>', 0.001)
    description = parse_urdf(f'<robot name="box">{text}</robot>')
    box = world.spawn("box", description, Pose((0.0, 0.0, 0.05)))
    bench.advance(0.3, 0.0, 0.0, 0.0)
    bench.advance(2.0, 0.06, 0.06, 0.0)
    fingers = [bench.robot.hardware.joints[name].position for name in ("left", "right")]
    assert fingers == pytest.approx([0.05, 0.05], abs=0.003)
    bench.advance(2.0, 0.06, 0.06, 0.3)
    assert box.state()[0].position == pytest.approx((0.0, 0.0, 0.35), abs=0.01)
