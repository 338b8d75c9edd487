"""What joints transmit, with both engines (docs/contract/sensors.md 6e, 11.5)."""

import numpy as np
import pytest
from support.robots.snippets import inertial, link, robot

from robot_sim.applied_forces import ActingTime, AppliedEffort, AppliedWrench
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.sensors.force_torque import JointForces, LinkForces
from robot_sim.simulator import Simulator

G = 9.8
ROBOT = f"""<robot name="r"><link name="world"/>{link("base", 5)}<link name="arm">{inertial(2, "0.5 0 0")}
<collision><origin xyz="0.5 0 0"/><geometry><sphere radius=".1"/></geometry></collision></link>
{link("tip", com="0 0 -0.2")}
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 {{z}}"/></joint>
<joint name="wrist" type="{{kind}}"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<origin xyz="0.1 0 0" rpy="{{rpy}}"/><limit lower="{{low}}" upper="0" effort="1000" velocity="100"/></joint>
<joint name="hook" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0.5 0 0"/></joint>
<gazebo reference="wrist"><disableFixedJointLumping>1</disableFixedJointLumping></gazebo>
<gazebo reference="hook"><preserveFixedJoint>1</preserveFixedJoint></gazebo></robot>"""
EVER = ActingTime(0, -1)


@pytest.fixture
def make(make_world):
    def build(kind="fixed", rpy="0 0 0", low=0, ground=False, z=1.0):
        sim = Simulator(make_world(ground=ground), lockstep=True)
        text = ROBOT.format(kind=kind, rpy=rpy, low=low, z=z)
        return sim, sim.world.spawn("r", parse_urdf(text), Pose())

    return build


def borne(sim, forces, ticks=20):
    """What `forces` measures after some ticks."""
    sim.listeners = [lambda now: forces.look(now, 0)]
    sim.advance(ticks)
    return np.ravel(forces.wrench())


@pytest.mark.parametrize("kind", ["fixed", "revolute", "prismatic"])
def test_a_joint_that_stands_bears_weight_and_the_torque_of_an_arm(make, kind):
    """A hinge does so by its stop; both bodies hang half a metre away."""
    sim, model = make(kind)
    found = borne(sim, JointForces(sim, model, "wrist"), 300)
    np.testing.assert_allclose(found, [0, 0, -3 * G, 0, 3 * G * 0.5, 0], atol=0.01 * 3 * G)
    hook = borne(sim, JointForces(sim, model, "hook"))
    np.testing.assert_allclose(hook, [0, 0, -G, 0, 0, 0], atol=0.01 * G)


def test_the_axes_are_the_childs_and_the_worlds_joint_bears_all(make):
    sim, model = make(rpy="1.5707963 0 0")
    found = borne(sim, JointForces(sim, model, "wrist"))
    np.testing.assert_allclose(found[:3], [0, -3 * G, 0], atol=2e-2)  # MuJoCo's stops yield
    mount = borne(sim, JointForces(sim, model, "mount"))
    np.testing.assert_allclose(mount[:3], [0, 0, -8 * G], atol=1e-2)


def test_the_effort_that_drives_a_joint_is_taken_out(make):
    """It holds the arm; a joint that nothing drives transmits no torque about its axis."""
    sim, model = make("revolute", low=-1)
    hold = -3 * G * 0.5
    sim.applied.efforts.append(AppliedEffort(model, "wrist", hold, EVER))
    found = borne(sim, JointForces(sim, model, "wrist"))
    np.testing.assert_allclose(found, [0, 0, -3 * G, 0, 0, 0], atol=1e-3)
    assert model.joint_state("wrist")[0] == pytest.approx(0.0, abs=1e-6)


def test_a_falling_arm_weighs_less(make):
    sim, model = make("revolute", low=-1)
    model.set_stops("wrist", None, 1.0)
    found = borne(sim, JointForces(sim, model, "wrist"), 3)
    # About the hinge: 2 kg and 1 kg at 0.5 m, their own moments, and 0.2 m below for the tip.
    moment = 3 * 0.25 + 0.2 + 0.2**2
    acceleration = 3 * G * 0.5 / moment
    assert found[4] == pytest.approx(0.0, abs=0.05)
    assert found[2] == pytest.approx(-3 * (G - 0.5 * acceleration), rel=0.01)


def test_what_velocity_decay_takes_is_no_load_of_the_joint(make_world):
    """Nothing but the centripetal force of the arm and its tip acts, though the arm slows down."""
    sim = Simulator(make_world(gravity=(0.0, 0.0, 0.0)), lockstep=True)
    block = '<gazebo reference="{}"><dampingFactor>0.01</dampingFactor></gazebo>'
    block = block.format("arm") + block.format("tip")
    text = ROBOT.format(kind="revolute", rpy="0 0 0", low=-3, z=1.0)
    model = sim.world.spawn("r", parse_urdf(text.replace("</robot>", f"{block}</robot>")), Pose())
    model.set_stops("wrist", None, 3.0)
    model.set_joint_velocities({"wrist": 1.0})
    found = borne(sim, JointForces(sim, model, "wrist"), 10)
    speed = model.joint_state("wrist")[1]
    assert speed == pytest.approx(0.99**10, rel=1e-3)
    speed /= 0.99  # before the last step, which is what it measures
    # The child pulls outwards, along its own x and, for the tip that hangs down, z.
    np.testing.assert_allclose(found[:3], [3 * 0.5 * speed**2, 0, -0.2 * speed**2], atol=0.005)
    assert found[4] == pytest.approx(0.0, abs=0.02)


def test_what_the_ground_or_a_client_bears_does_not_hang_on_the_joint(make):
    """The arm's ball touches the ground below a vertical slide."""
    sim, model = make("prismatic", low=-1, ground=True, z=0.1, rpy="1.5707963 0 0")
    found = borne(sim, JointForces(sim, model, "wrist"), 500)
    assert found[1] == pytest.approx(0.0, abs=0.1)
    sim, model = make()
    lift = ((0.0, 0.0, 3 * G), (0.0, 0.0, 0.0))
    sim.applied.wrenches.append(AppliedWrench(model, "arm", lift, EVER))
    np.testing.assert_allclose(borne(sim, JointForces(sim, model, "wrist")), 0.0, atol=1e-2)


def test_after_a_move_nothing_is_known_until_two_ticks_have_passed(make):
    sim, model = make()
    forces = JointForces(sim, model, "wrist")
    assert borne(sim, forces) is not None
    forces.look(sim.now, 1)
    assert forces.wrench() is None
    sim.listeners = [lambda now: forces.look(now, 1)]
    for known in (False, True):
        sim.advance(1)
        assert (forces.wrench() is not None) == known


def test_a_joint_that_is_not_there_is_refused(make):
    sim, model = make()
    with pytest.raises(DescriptionError, match="no joint 'elbow'"):
        JointForces(sim, model, "elbow")


def test_the_net_force_on_a_link_is_what_accelerates_it(make_world):
    sim = Simulator(make_world(ground=True), lockstep=True)
    shape = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    description = parse_urdf(robot(link("b", 2, more=shape)))
    box = sim.world.spawn("b", description, Pose((0.0, 0.0, 0.6), from_rpy(0.0, 0.0, 0.3)))
    forces = LinkForces(sim, box, ["b"])
    sim.listeners = [lambda now: forces.look(now, 0)]
    sim.advance(5)
    np.testing.assert_allclose(forces.net[0], [0, 0, -2 * G], atol=1e-6)
    sim.advance(800)
    np.testing.assert_allclose(forces.net[0], 0.0, atol=1e-2)
    assert forces.known[0][2] == pytest.approx(0.0, abs=0.2)  # the ground bears its weight
