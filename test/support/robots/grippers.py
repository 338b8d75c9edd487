"""A gripper as URDF text: two fingers on a lift, one driven, one that follows it, and a cube between them."""

CUBE = 0.05  # [m]
EFFORT = 10.0  # [N] of the driven finger
MIMIC = '<mimic joint="left"/>'


def link(name: str, mass: float, size: str, more: str = "") -> str:
    """Returns a box."""
    inertia = f'ixx="{mass * 1e-3}" iyy="{mass * 1e-3}" izz="{mass * 1e-3}" ixy="0" ixz="0" iyz="0"'
    return f"""<link name="{name}"><inertial><mass value="{mass}"/><inertia {inertia}/></inertial>
      <collision name="box"><geometry><box size="{size}"/></geometry></collision>{more}</link>"""


def joint(name: str, parent: str, place: str, axis: str, limit: str, more: str = "") -> str:
    """Returns a sliding joint, whose child is called after it."""
    return f"""<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{name}_link"/>
      <origin xyz="{place}"/><axis xyz="{axis}"/><limit {limit} velocity="1"/>
      <dynamics damping="5"/>{more}</joint>"""


def transmission(name: str, interface: str) -> str:
    """Returns a joint's transmission."""
    kind = f"hardware_interface/{interface}JointInterface"
    return f"""<transmission name="{name}_t"><type>transmission_interface/SimpleTransmission</type>
      <joint name="{name}"><hardwareInterface>{kind}</hardwareInterface></joint>
      <actuator name="{name}_m"/></transmission>"""


def plugin(library: str, **elements: object) -> str:
    """Returns a plugin of the model."""
    inner = "".join(f"<{tag}>{value}</{tag}>" for tag, value in elements.items())
    return f'<gazebo><plugin name="{library}" filename="{library}">{inner}</plugin></gazebo>'


def gripper(interface: str = "Effort", mimic: str = MIMIC, more: str = "") -> str:
    """Returns the gripper. Its pads are at the height of a cube on the ground while the lift is at 0.

    The joint `left` has the interface; that of `lift` is Velocity; `right`, with `mimic`, has none.
    """
    limit = f'lower="0" upper="0.05" effort="{EFFORT}"'
    pad = "0.03 0.02 0.06"
    parts = [
        '<link name="world"/>',
        link("lift_link", 1.0, "0.02 0.02 0.02"),
        joint("lift", "world", "0 0 0.3", "0 0 1", 'lower="0" upper="0.5" effort="500"'),
        link("left_link", 0.05, pad),
        joint("left", "lift_link", "0 0.06 -0.265", "0 -1 0", limit),
        link("right_link", 0.05, pad),
        joint("right", "lift_link", "0 -0.06 -0.265", "0 1 0", limit, mimic),
        transmission("lift", "Velocity"),
        transmission("left", interface),
    ]
    return f'<robot name="gripper">{"".join(parts)}{more}</robot>'


def cube(mass: float = 0.05) -> str:
    """Returns a cube of CUBE."""
    inertia = f"{mass * CUBE**2 / 6.0}"
    moments = f'ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"'
    return f"""<robot name="cube"><link name="cube_link"><inertial><mass value="{mass}"/>
      <inertia {moments}/></inertial><collision name="box"><geometry>
      <box size="{CUBE} {CUBE} {CUBE}"/></geometry></collision></link></robot>"""
