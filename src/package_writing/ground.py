"""How high a robot has to be spawned to stand on the ground."""

import math

import numpy as np

from bullet_gazebo.physics.description import ModelDescription, Shape
from bullet_gazebo.physics.dynamics import poses_at_zero
from bullet_gazebo.physics.pose import Pose, conjugate, rotate


def standing_height(model: ModelDescription) -> float | None:
    """Returns the least height [m], with three decimals, at which no collision lies below the ground, all
    joints being at zero; None if there is no collision."""
    lows = [
        _low(shape, pose.compose(shape.pose))
        for name, pose in poses_at_zero(model).items()
        for shape in model.links[name].collisions
    ]
    if not lows:
        return None
    return max(0.0, math.ceil(round(-min(lows) * 1000.0, 6)) / 1000.0)  # 0.1 stays 0.1


def height_told(height: float, stands: float | None) -> str:
    """What is told of the height [m] at which a robot is spawned, that stands on the ground at another."""
    if stands is None:
        return "note: it has no <collision>, so that it falls through the ground"
    told = f"spawned at a height of {height:g} m"
    if height < stands:
        return f"note: {told} its lowest collision lies below the ground; --height {stands:g} is enough"
    return f"{told}; its lowest collision touches the ground at {stands:g} m"


def _low(shape: Shape, pose: Pose) -> float:
    """The height of a shape's lowest point [m]."""
    up = np.array(rotate(conjugate(pose.orientation), (0.0, 0.0, 1.0)))  # as the shape sees it
    size = np.array(shape.size)
    if shape.kind == "sphere":
        reach = float(size[0])
    elif shape.kind == "cylinder":
        reach = float(size[0] * math.hypot(up[0], up[1]) + size[1] / 2.0 * abs(up[2]))
    elif shape.solid is not None:
        reach = -float(np.min(np.concatenate(shape.solid.hulls) * size @ up))
    else:
        reach = float(np.abs(up) @ size / 2.0)
    return pose.position[2] - reach
