"""Gains for a start: each joint follows its set-point within some tenths of a second, and doesn't shake."""

import math

from bullet_gazebo.physics.description import ModelDescription
from bullet_gazebo.physics.dynamics import (
    effective_inertias,
    most_inertias,
    poses_at_zero,
)

FREQUENCY = (
    12.0  # [rad/s], at least, of a joint on its p and d with all that it carries stretched out
)
HIGHEST = 250.0  # [rad/s], of what a joint moves in itself: steps of 1 ms can't follow more
MOST = 25.0  # times that, which it may carry
SAG = 0.1  # [rad, m], at most, by its weight on p alone
SHARE = 0.05  # of its range, at most as well
GRAVITY = 9.81  # [m/s²]
VELOCITY = 5.0  # [1/s], where the output is a velocity

CLAMP = 5.0  # [rad/s], of a wheel: i does no more than p where it is that much too slow

Gains = dict[str, float]


def effort_gains(model: ModelDescription) -> dict[str, Gains]:
    """Gains of position controllers whose output is an effort, by joint.

    p and d make a critically damped spring of the joint and what it carries, stiff enough for its weight,
    and i, within its clamp, holds that against gravity.
    """
    carried = most_inertias(model)
    own = effective_inertias(model, poses_at_zero(model))
    below = _masses(model)
    found = {}
    for name, inertia in carried.items():
        ratio = min(inertia / own[name], MOST) if own[name] > 0.0 else 1.0
        moved = own[name] * ratio or inertia
        weight = GRAVITY * math.sqrt(below[name] * inertia)  # no less than it can weigh [N m, N]
        joint = model.joints[name]
        sag = min(SAG, SHARE * (joint.upper - joint.lower)) if joint.bounded else SAG
        frequency = min(max(FREQUENCY, math.sqrt(weight / sag / moved)), HIGHEST / ratio)
        p = moved * frequency**2
        found[name] = _rounded(
            {"p": p, "i": 2.0 * p, "d": 2.0 * moved * frequency, "i_clamp": weight}
        )
    return found


def velocity_gains() -> Gains:
    """Those of one whose output is a velocity."""
    return {"p": VELOCITY}


def wheel_gains(model: ModelDescription) -> dict[str, Gains]:
    """Gains of velocity controllers whose output is an effort, by joint.

    p is as stiff as steps of 1 ms can follow with the wheel in the air; i holds against slopes, friction.
    """
    found = {}
    for name, inertia in effective_inertias(model, poses_at_zero(model)).items():
        p = HIGHEST * inertia
        found[name] = _rounded({"p": p, "i": VELOCITY * p, "d": 0.0, "i_clamp": CLAMP * p})
    return found


def _masses(model: ModelDescription) -> dict[str, float]:
    """What each movable joint carries [kg]."""
    found = {}
    for joint in model.movable_joints:
        links = [joint.child]
        for name in links:
            links += [each.child for each in model.joints.values() if each.parent == name]
        inertias = [model.links[name].inertia for name in links]
        found[joint.name] = sum(each.mass for each in inertias if each is not None)
    return found


def _rounded(gains: Gains) -> Gains:
    return {name: float(f"{value:.3g}") for name, value in gains.items()}
