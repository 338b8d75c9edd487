"""Passive forces: joints' springs, velocity decay, and kinematic links, which no force moves."""

from math import hypot

from robot_sim.physics.engine import Twist
from robot_sim.physics.model import Model
from robot_sim.physics.pose import ZERO, Pose, Vector, add, conjugate, cross, rotate, scale, subtract

SLOWEST = 0.01  # [m/s, rad/s]; ODE lets no slower velocity decay


def are_on(model: Model) -> bool:
    """Returns whether springs or decay act on a model, or its root link is kinematic."""
    return bool(model.springs or model.decaying or model.kinematic)


def apply(model: Model) -> None:
    """Adds the forces of springs, and those by which velocities decay, to the next step's."""
    if model.springs:
        states, joints = model.body.joint_states(), model.description.joints
        efforts = [0.0] * len(states)
        for name, stiffness in model.springs.items():
            index = model.joint_index(name)
            efforts[index] = stiffness * (joints[name].spring_reference - states[index][0])
        model.body.apply_efforts(efforts)
    wrenches = [(link, decay_wrench(model, link)) for link in model.decaying]
    for link, wrench in wrenches:
        model.body.add_wrench(link, *wrench)


def decay_wrench(model: Model, name: str) -> tuple[Vector, Vector]:
    """Returns the force [N] at the centre of mass and the torque [N m] by which a link's velocity decays.

    In a step they take a share of the momentum that it has before, as ODE takes it after each step.
    """
    inertia = model.description.links[name].inertia
    if name not in model.decaying or inertia is None:
        return ZERO, ZERO
    centre, twist = _centre(model, name)
    linear, angular = _lost(model, name, twist)
    axes, rate = centre.orientation, -1.0 / model.time_step
    x, y, z = rotate(conjugate(axes), angular)
    momentum = (
        inertia.ixx * x + inertia.ixy * y + inertia.ixz * z,
        inertia.ixy * x + inertia.iyy * y + inertia.iyz * z,
        inertia.ixz * x + inertia.iyz * y + inertia.izz * z,
    )
    return scale(linear, inertia.mass * rate), scale(rotate(axes, momentum), rate)


def kinematic_twist(model: Model) -> Twist:
    """Returns the twist that a kinematic root's centre of mass has after a step, whatever it meets."""
    root = model.description.root
    _, (linear, angular) = _centre(model, root)
    lost = _lost(model, root, (linear, angular))
    return subtract(linear, lost[0]), subtract(angular, lost[1])


def set_kinematic_twist(model: Model, twist: Twist) -> None:
    """Gives a kinematic root's centre of mass a twist."""
    linear, angular = twist
    centre, _ = _centre(model, model.description.root)
    arm = subtract(centre.position, model.root_state()[0].position)
    model.body.set_base_twist((subtract(linear, cross(angular, arm)), angular))


def _centre(model: Model, name: str) -> tuple[Pose, Twist]:
    """Returns pose and twist of a link's centre of mass, in world axes."""
    inertia = model.description.links[name].inertia
    pose, (linear, angular) = model.link_state(name)
    centre = pose if inertia is None else pose.compose(inertia.com)
    arm = subtract(centre.position, pose.position)
    return centre, (add(linear, cross(angular, arm)), angular)


def _lost(model: Model, name: str, twist: Twist) -> Twist:
    """Returns what a link's centre loses of its twist in a step."""
    linear, angular = model.description.links[name].decay or (0.0, 0.0)
    return (
        scale(twist[0], linear) if hypot(*twist[0]) > SLOWEST else ZERO,
        scale(twist[1], angular) if hypot(*twist[1]) > SLOWEST else ZERO,
    )
