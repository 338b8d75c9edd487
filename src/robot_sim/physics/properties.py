"""Properties of links and joints that can be changed at run time."""

import math
from dataclasses import dataclass

from robot_sim.physics.description import Inertia
from robot_sim.physics.dynamics import is_positive_definite
from robot_sim.physics.model import Model
from robot_sim.physics.world import World

GAZEBO_INERTIA = Inertia(mass=1.0, ixx=1.0, iyy=1.0, izz=1.0)  # of a link that has none in its file


class PropertyError(ValueError):
    """No body can have a property; the text says which and why."""


@dataclass(frozen=True)
class JointProperties:
    """New properties of a joint; None keeps one. [N m s/rad, N s/m], [rad, m], [N m, N], [rad/s, m/s]."""

    damping: float | None = None
    lower: float | None = None
    upper: float | None = None
    motor_effort: float | None = None
    motor_velocity: float | None = None


def link_inertia(model: Model, link: str) -> Inertia:
    """Returns mass, centre of mass and tensor of a link, as Gazebo reports them."""
    return model.description.links[link].inertia or GAZEBO_INERTIA


def set_link_properties(world: World, model: Model, link: str, inertia: Inertia, gravity: bool) -> None:
    """Sets a link's inertia and gravity mode. They have no effect on a static model.

    Raises PropertyError if no body can have them; nothing changes then.
    """
    if not is_positive_definite(inertia):
        raise PropertyError(f"mass {inertia.mass} and inertia of '{link}' must be positive (definite)")
    if inertia != model.description.links[link].inertia:
        world.set_inertia(model, link, inertia)
    record = model.description.links[link]
    record.gravity = gravity
    model.body.set_link_gravity(link, record.weighs)


def set_joint_properties(model: Model, name: str, wanted: JointProperties, time_step: float) -> None:
    """Changes a joint's damping, stops and motor, as far as they are given.

    Raises PropertyError if no joint can have them; nothing changes then.
    """
    if wanted.damping is not None and wanted.damping < 0.0:
        raise PropertyError(f"a damping of {wanted.damping} would drive the joint; it must be >= 0")
    if wanted.motor_effort is not None and wanted.motor_effort < 0.0:
        raise PropertyError(f"fmax is {wanted.motor_effort}; it must be >= 0")
    if name not in model.joint_names:
        return  # a fixed joint has none of them
    if wanted.damping is not None:
        model.description.joints[name].damping = wanted.damping
        model.apply_damping(time_step)
    if wanted.lower is not None or wanted.upper is not None:
        model.set_stops(name, wanted.lower, wanted.upper)
    if wanted.motor_effort is not None or wanted.motor_velocity is not None:
        model.set_motor(name, wanted.motor_velocity, wanted.motor_effort)


def set_link_friction(model: Model, link: str, factor: float) -> None:
    """Multiplies the friction of the file for the collisions of a link by `factor`.

    Raises PropertyError if it is negative, or not finite.
    """
    if not 0.0 <= factor < math.inf:
        raise PropertyError(f"friction of '{link}' must be a factor >= 0, not {factor}")
    model.set_friction(link, factor)
