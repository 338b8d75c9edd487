"""Random robots: chains of links of random shapes and sizes."""

import random

LINK = """<link name="{name}"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
<collision><geometry>{shape}</geometry></collision><visual><geometry>{shape}</geometry></visual></link>"""
JOINT = """<joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0 0 {z}"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="10" velocity="5"/></joint>"""


def random_robot(dice: random.Random) -> str:
    """A chain of some links, each of another shape and size than any before."""
    parts = []
    for number in range(dice.randint(1, 5)):
        length, radius = dice.uniform(0.05, 0.6), dice.uniform(0.01, 0.1)
        shape = dice.choice(
            [
                f'<cylinder length="{length}" radius="{radius}"/>',
                f'<box size="{radius} {length} {radius}"/>',
                f'<sphere radius="{radius}"/>',
                f'<mesh filename="package://cartpole/test/data/models/crate/meshes/cube.obj"'
                f' scale="{radius} {radius} {length}"/>',
            ]
        )
        about = {"z": length, "mass": dice.uniform(0.1, 3.0), "shape": shape}
        parts.append(LINK.format(name=f"l{number}", **about))
        if number:
            kind = dice.choice(["revolute", "prismatic", "fixed", "continuous"])
            ends = {"parent": f"l{number - 1}", "child": f"l{number}", "z": length}
            parts.append(JOINT.format(name=f"j{number}", type=kind, **ends))
    return f'<robot name="r">{"".join(parts)}</robot>'
