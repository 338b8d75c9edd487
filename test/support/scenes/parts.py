"""Links, joints and transmissions of the scenes' URDFs."""

INERTIA = '<inertia ixx="{0}" ixy="0" ixz="0" iyy="{0}" iyz="0" izz="{0}"/>'
PLUGIN = """<gazebo><plugin name="control" filename="libgazebo_ros_control.so">
  <robotNamespace>{}</robotNamespace></plugin></gazebo>"""


def link(name: str, shape: str, mass: float, at: str = "0 0 0", turned: str = "0 0 0") -> str:
    """A link of one shape, which is seen and touched."""
    geometry = f'<origin xyz="{at}" rpy="{turned}"/><geometry>{shape}</geometry>'
    inertia = INERTIA.format(0.01 * mass)
    return f"""<link name="{name}">
  <inertial><origin xyz="{at}"/><mass value="{mass}"/>{inertia}</inertial>
  <visual>{geometry}</visual><collision>{geometry}</collision></link>"""


def joint(name: str, kind: str, parent: str, child: str, at: str, axis: str = "0 1 0") -> str:
    """A joint, with limits where it turns between some."""
    limit = '<limit lower="-2.5" upper="2.5" effort="60" velocity="8"/>' if kind == "revolute" else ""
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="{at}"/><axis xyz="{axis}"/>{limit}<dynamics damping="0.02"/></joint>"""


def transmission(name: str, interface: str) -> str:
    """What makes a joint known to ros_control."""
    return f"""<transmission name="{name}_transmission">
  <type>transmission_interface/SimpleTransmission</type>
  <joint name="{name}"><hardwareInterface>hardware_interface/{interface}JointInterface</hardwareInterface>
  </joint><actuator name="{name}_motor"/></transmission>"""


def plugin(namespace: str = "") -> str:
    """What gives a robot its controllers."""
    return PLUGIN.format(namespace)
