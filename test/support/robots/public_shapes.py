"""Robots of the shapes that public ones have: an arm of meshes, a vehicle on springs."""

from pathlib import Path

from support.mutations.mesh_files import CORNERS, binary_stl, dae

INERTIAL = (
    '<inertial><mass value="{0}"/>'
    '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
)
LONG = 0.4  # [m], of a link of the arm
STIFFNESS, MASS = 2000.0, 20.0  # [N/m] of a wheel's spring, [kg] of the hull
RADIUS, DROP = 0.1, 0.2  # [m] of a wheel, and of its axle below the hull's origin


def mesh_arm(folder: Path, kind: str) -> str:
    """URDF of an arm whose links are meshes: "stl", or "dae" with millimetres and a y axis up."""
    parts = ['<link name="world"/>']
    below, joint = "world", "fixed"
    for number, (width, depth) in enumerate([(0.2, 0.1), (0.1, 0.06), (0.06, 0.04)]):
        name, path = f"link_{number}", folder / f"link_{number}.{kind}"
        corners = [
            (x * width / 2.0, y * depth / 2.0, (z + 1.0) * LONG / 2.0) for x, y, z in CORNERS
        ]
        if kind == "stl":
            path.write_bytes(binary_stl(corners=corners))
        else:
            millimetres = [tuple(1000.0 * each for each in corner) for corner in corners]
            path.write_bytes(dae("0.001", "Y_UP", millimetres))
        geometry = f'<geometry><mesh filename="{path.as_uri()}"/></geometry>'
        shapes = f"<collision>{geometry}</collision><visual>{geometry}</visual>"
        origin = f'<origin xyz="0 0 {LONG if number else 0}" rpy="0 {0.5 * number} 0"/>'
        limit = '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="200" velocity="2"/>'
        parts.append(
            f'<link name="{name}">{INERTIAL.format(1)}{shapes}</link><joint name="joint_{number}" '
            f'type="{joint}"><parent link="{below}"/><child link="{name}"/>{origin}{limit}</joint>'
        )
        below, joint = name, "revolute"
    return f'<robot name="mesh_arm">{"".join(parts)}</robot>'


def suspension() -> str:
    """URDF of a vehicle whose four wheels hang on prismatic joints with springs and dampers."""
    shape = '<geometry><box size="1 0.6 0.1"/></geometry>'
    hull = f"<collision>{shape}</collision><visual>{shape}</visual>"
    parts = [f'<link name="hull">{INERTIAL.format(MASS)}{hull}</link>']
    parts.append('<gazebo reference="hull"><material>Gazebo/Blue</material></gazebo>')
    shape = f'<geometry><sphere radius="{RADIUS}"/></geometry>'
    wheel = f"<collision>{shape}</collision><visual>{shape}</visual>"
    strut = '<visual><geometry><box size="0.03 0.03 0.3"/></geometry></visual>'
    for front in (1, -1):
        for left in (1, -1):
            name = f"{'front' if front > 0 else 'rear'}_{'left' if left > 0 else 'right'}"
            parts.append(
                f'<link name="{name}_strut">{INERTIAL.format(0.5)}{strut}</link>'
                f'<joint name="{name}_slide" type="prismatic"><parent link="hull"/>'
                f'<child link="{name}_strut"/><origin xyz="{0.4 * front} {0.3 * left} {-DROP}"/>'
                '<axis xyz="0 0 1"/><limit lower="-0.1" upper="0.1" effort="1000" velocity="10"/>'
                '<dynamics damping="200"/></joint>'
                f'<gazebo reference="{name}_slide"><springStiffness>{STIFFNESS}</springStiffness>'
                "<springReference>0</springReference></gazebo>"
                f'<link name="{name}_wheel">{INERTIAL.format(0.5)}{wheel}</link>'
                f'<joint name="{name}_axle" type="continuous"><parent link="{name}_strut"/>'
                f'<child link="{name}_wheel"/><axis xyz="0 1 0"/></joint>'
            )
    return f'<robot name="suspension">{"".join(parts)}</robot>'
