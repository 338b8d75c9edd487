"""Initial controller gains, from the inertias that they move."""

import math
from collections.abc import Mapping

from package_writing.standing import centre_of_mass, feet
from robot_sim.physics.description import ModelDescription
from robot_sim.physics.dynamics import effective_inertias, most_inertias, poses_at_zero
from robot_sim.physics.pose import rotate

# [rad/s], at least, of a joint on its p and d with all that it carries stretched out
FREQUENCY = 12.0
HIGHEST = 250.0  # [rad/s], of a joint's own inertia; steps of 1 ms can't follow a higher one
STIFFEST = 700.0  # [rad/s], likewise, of the p alone with which a leg balances its body
DAMPED = 350.0  # [rad/s], likewise, of its d alone
TRIPOD = 3  # feet that need no balance; on fewer i would feed the body's slow sway
MARGIN = 2.0  # of p over what lets a body tip over about a leg's joint
MOST = 25.0  # largest ratio of carried to own inertia
SAG = 0.1  # [rad, m], largest sag under its weight with p alone
SHARE = 0.05  # largest sag as a share of the joint's range
GRAVITY = 9.81  # [m/s²]
VELOCITY = 5.0  # [1/s], p if the output is a velocity

CLAMP = 5.0  # [rad/s], of a wheel: i gives at most what p gives at this velocity error

Gains = dict[str, float]


def effort_gains(model: ModelDescription) -> dict[str, Gains]:
    """Returns gains of position controllers with an effort as output, by joint.

    p and d make joint and load a critically damped spring, stiff enough for their weight; i, within its
    clamp, compensates gravity. The joints of legs carry the body, too.
    """
    carried = most_inertias(model)
    own = effective_inertias(model, poses_at_zero(model))
    below = _masses(model)
    stances = _stances(model, below)
    balancing = stances if len(feet(model)) < TRIPOD else {}
    gains = {}
    for name, inertia in carried.items():
        ratio = min(inertia / own[name], MOST) if own[name] > 0.0 else 1.0
        moved = own[name] * ratio or inertia
        weight = GRAVITY * math.sqrt(below[name] * inertia)  # upper bound of the load [N m, N]
        joint = model.joints[name]
        sag = min(SAG, SHARE * (joint.upper - joint.lower)) if joint.bounded else SAG
        frequency = min(max(FREQUENCY, math.sqrt(weight / sag / moved)), HIGHEST / ratio)
        p, d = moved * frequency**2, 2.0 * moved * frequency
        stable = math.inf  # the largest i with which joint and load don't shake
        if name in stances:
            load, standing, tipping = stances[name]
            fastest = DAMPED if name in balancing else HIGHEST
            p = max(p, min(load / sag, own[name] * HIGHEST**2))
            p = max(p, min(MARGIN * tipping, own[name] * STIFFEST**2))
            d = max(d, min(2.0 * math.sqrt(p * standing), 2.0 * own[name] * fastest))
            weight = max(weight, load)
            stable = p * d / standing if standing else math.inf
        i = 0.0 if name in balancing else min(2.0 * p, stable / 2.0)
        gains[name] = _rounded({"p": p, "i": i, "d": d, "i_clamp": weight})
    return gains


def _stances(model: ModelDescription, below: Mapping[str, float]) -> dict[str, tuple[float, float, float]]:
    """Returns load, inertia and m g h [N m, kg m², N m/rad] of legs' joints, half the feet on the ground.

    The body above a joint is an inverted pendulum, which a p of m g h or less lets fall.
    `below` is the mass that each joint carries with its foot in the air [kg].
    """
    poses, on = poses_at_zero(model), feet(model)
    top = centre_of_mass(model, poses)[2] if on else 0.0
    total = sum(each.inertia.mass for each in model.links.values() if each.inertia is not None)
    stances = {}
    for foot in on:
        for joint in (each for each in model.carriers(foot) if each.movable):
            frame = poses[joint.child].compose(joint.anchor)
            x, y, z = rotate(frame.orientation, joint.axis)
            mass = (total - below[joint.name]) / max(1, len(on) // 2)
            if joint.kind == "prismatic":
                stances[joint.name] = (GRAVITY * mass * abs(z), mass, 0.0)
            else:
                soles = [poses[foot].compose(each.pose) for each in model.links[foot].collisions]
                arm = max(math.dist(frame.position, each.position) for each in soles)
                height, level = max(0.0, float(top) - frame.position[2]), math.hypot(x, y)
                stances[joint.name] = (
                    GRAVITY * mass * arm * level,
                    mass * max(arm, height) ** 2,
                    GRAVITY * mass * height * level,
                )
    return stances


def wheel_gains(model: ModelDescription) -> dict[str, Gains]:
    """Returns gains of velocity controllers with an effort as output, by joint.

    p is as stiff as steps of 1 ms allow with the wheel in the air; i compensates slopes and friction.
    """
    gains = {}
    for name, inertia in effective_inertias(model, poses_at_zero(model)).items():
        p = HIGHEST * inertia
        gains[name] = _rounded({"p": p, "i": VELOCITY * p, "d": 0.0, "i_clamp": CLAMP * p})
    return gains


def _masses(model: ModelDescription) -> dict[str, float]:
    """Returns the mass that each movable joint carries [kg]."""
    masses = {}
    for joint in model.movable_joints:
        links = [joint.child]
        for name in links:
            links += [each.child for each in model.joints.values() if each.parent == name]
        inertias = [model.links[name].inertia for name in links]
        masses[joint.name] = sum(each.mass for each in inertias if each is not None)
    return masses


def _rounded(gains: Gains) -> Gains:
    return {name: float(f"{value:.3g}") for name, value in gains.items()}
