"""Vehicles as URDF text: wheels of 0.1 m around a flat box, and smooth balls that carry it."""

from collections.abc import Mapping

RADIUS = 0.1  # [m] of the wheels
TRACK = 0.4  # [m] from the left to the right ones
BASE = 0.3  # [m] from the rear to the front ones of four wheels
WHEELBASE = 0.5  # [m] of three wheels


def _link(name: str, mass: float, shape: str, inertia: float, rpy: str = "0 0 0") -> str:
    return f"""<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="{inertia}"
      iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin rpy="{rpy}"/>
      <geometry>{shape}</geometry></collision></link>"""


def wheel(name: str, place: str, parent: str = "base", interface: str = "Velocity") -> str:
    rim = f'<cylinder radius="{RADIUS}" length="0.04"/>'
    return (
        _link(f"{name}_wheel", 0.5, rim, 0.0025, "1.5707963267948966 0 0")
        + _joint(f"{name}_joint", "continuous", parent, f"{name}_wheel", place, "0 1 0", 50.0)
        + (_transmission(f"{name}_joint", interface) if interface else "")
    )


def _joint(
    name: str, kind: str, parent: str, child: str, place: str, axis: str = "0 0 1", speed: float = 1.0
) -> str:
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
      <origin xyz="{place}"/><axis xyz="{axis}"/>
      <limit lower="-2" upper="2" effort="20" velocity="{speed}"/></joint>"""


def _transmission(joint: str, interface: str) -> str:
    kind = f"hardware_interface/{interface}JointInterface"
    return f"""<transmission name="{joint}_t"><type>transmission_interface/SimpleTransmission</type>
      <joint name="{joint}"><hardwareInterface>{kind}</hardwareInterface></joint>
      <actuator name="{joint}_m"/></transmission>"""


def _steered(name: str, place: str, interface: str = "Velocity") -> str:
    pivot = _link(f"{name}_fork", 0.2, '<box size="0.02 0.02 0.02"/>', 0.001)
    pivot += _joint(f"{name}_steering", "revolute", "base", f"{name}_fork", place)
    pivot += _transmission(f"{name}_steering", "Position")
    return pivot + wheel(name, "0 0 0", f"{name}_fork", interface)


def _ball(name: str, place: str, friction: float) -> str:
    return (
        _link(name, 0.1, '<sphere radius="0.05"/>', 0.0002)
        + _joint(f"{name}_joint", "fixed", "base", name, place)
        + f'<gazebo reference="{name}"><mu1>{friction}</mu1><mu2>{friction}</mu2></gazebo>'
    )


def _vehicle(parts: list[str], plugins: Mapping[str, Mapping[str, object]]) -> str:
    box = _link("base", 5.0, '<box size="0.3 0.2 0.05"/>', 0.05)
    written = "".join(
        f'<gazebo><plugin name="{library}" filename="{library}">'
        + "".join(f"<{tag}>{value}</{tag}>" for tag, value in elements.items())
        + "</plugin></gazebo>"
        for library, elements in plugins.items()
    )
    return f'<robot name="vehicle">{box}{"".join(parts)}{written}</robot>'


def two_wheels(**plugins: Mapping[str, object]) -> str:
    """Two wheels and a castor with little friction; plugins by library, with their elements."""
    half = 0.5 * TRACK
    wheels = [wheel("left", f"0 {half} 0"), wheel("right", f"0 {-half} 0")]
    return _vehicle([*wheels, _ball("castor", "-0.15 0 -0.05", 0.1)], plugins)


def four_wheels(steered: tuple[str, ...] = (), **plugins: Mapping[str, object]) -> str:
    """Four wheels at the corners, those of `steered` below a vertical joint."""
    parts = []
    for name, x, y in (
        ("left_front", 1, 1), ("left_rear", -1, 1), ("right_front", 1, -1), ("right_rear", -1, -1),
    ):  # fmt: skip
        make = _steered if name in steered else wheel
        parts.append(make(name, f"{0.5 * x * BASE} {0.5 * y * TRACK} 0"))
    return _vehicle(parts, plugins)


def three_wheels(front: str = "front", **plugins: Mapping[str, object]) -> str:
    """A steered wheel at the front, and two free ones below the middle."""
    half = 0.5 * TRACK
    wheels = [wheel("left", f"0 {half} 0"), wheel("right", f"0 {-half} 0")]
    return _vehicle([_steered(front, f"{WHEELBASE} 0 0"), *wheels], plugins)


def three_balls(**plugins: Mapping[str, object]) -> str:
    """A body on balls without friction."""
    places = ("0.15 0 -0.05", "-0.15 0.1 -0.05", "-0.15 -0.1 -0.05")
    balls = [_ball(f"ball_{number}", place, 0.0) for number, place in enumerate(places)]
    return _vehicle(balls, plugins)


def bicycle(**plugins: Mapping[str, object]) -> str:
    """A driven wheel and a steered one before it, with balls at the sides."""
    balls = [_ball(f"ball_{y}", f"0 {y} -0.048", 0.0) for y in (0.2, -0.2)]
    half = 0.5 * WHEELBASE
    wheels = [wheel("rear", f"{-half} 0 0"), _steered("front", f"{half} 0 0", "")]
    return _vehicle([*wheels, *balls], plugins)
