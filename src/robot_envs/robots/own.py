"""Descriptions of robots whose files come along."""

from functools import partial
from typing import Any

from robot_envs.files import own_file
from robot_envs.robot import Robot


def own_robot(name: str, *commanded: str, **options: Any) -> Robot:
    """Describes a robot by the name of its files; tasks command these controllers."""
    return Robot(
        urdf=partial(own_file, "cartpole", f"urdf/{name}.urdf.xacro"),
        controllers=partial(own_file, "cartpole", f"config/robots/{name}.yaml"),
        run=("joint_state_controller", *commanded),
        commanded=commanded,
        name=name,
        **options,
    )
