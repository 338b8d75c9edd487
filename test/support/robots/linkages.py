"""A planar four-bar linkage as SDF, with its closed form, furniture of welded boards, and a gripper."""

import math

from support.robots.snippets import box, collision, sdf, sdf_joint, sdf_link

CRANK, COUPLER, ROCKER, GROUND = 0.4, 1.0, 0.8, 1.0  # [m]
START = 1.0  # [rad], the crank's angle in the file
DENSITY = 2.0  # [kg/m]


def angles(crank: float) -> tuple[float, float]:
    """Returns the angles [rad] of coupler and rocker against the ground, for that of the crank."""
    x, z = CRANK * math.cos(crank), CRANK * math.sin(crank)
    reach = math.hypot(GROUND - x, z)
    corner = (COUPLER**2 + reach**2 - ROCKER**2) / (2.0 * COUPLER * reach)
    coupler = math.atan2(-z, GROUND - x) + math.acos(corner)
    tip = x + COUPLER * math.cos(coupler), z + COUPLER * math.sin(coupler)
    return coupler, math.atan2(tip[1], tip[0] - GROUND)


def rod(name: str, length: float, foot: tuple[float, float], angle: float) -> str:
    """Returns a link from `foot` [m] along x, turned up by `angle` [rad]."""
    mass, thin = DENSITY * length, 1e-4
    return f"""<link name="{name}"><pose>{foot[0]} 0 {foot[1]} 0 {-angle} 0</pose>
      <inertial><pose>{length / 2.0} 0 0 0 0 0</pose><mass>{mass}</mass><inertia><ixx>{thin}</ixx>
        <iyy>{mass * length**2 / 12.0}</iyy><izz>{mass * length**2 / 12.0}</izz></inertia></inertial>
    </link>"""


def hinge(name: str, parent: str, child: str, pose: str = "0 0 0 0 0 0", axis: str = "") -> str:
    """Returns a joint about -y, at `pose` in the child."""
    return f"""<joint name="{name}" type="revolute"><pose>{pose}</pose><parent>{parent}</parent>
      <child>{child}</child><axis><xyz>0 -1 0</xyz>{axis}</axis></joint>"""


def four_bar(closing: str = "", order: int = 1, static: bool = False, rooted: bool = True) -> str:
    """Returns SDF text; `closing` is added to the joint between coupler and rocker.

    With `order` -1 the joints come in the opposite order.
    """
    coupler, rocker = angles(START)
    pin = CRANK * math.cos(START), CRANK * math.sin(START)
    links = [
        rod("ground", GROUND, (0.0, 0.0), 0.0),
        rod("crank", CRANK, (0.0, 0.0), START),
        rod("coupler", COUPLER, pin, coupler),
        rod("rocker", ROCKER, (GROUND, 0.0), rocker),
    ]
    joints = [
        hinge("drive", "ground", "crank"),
        hinge("pin", "crank", "coupler"),
        hinge("pivot", "ground", "rocker"),
        hinge("tip", "coupler", "rocker", f"{ROCKER} 0 0 0 0 0", closing),
    ][::order]
    if rooted:
        joints.append(weld("foot", "world", "ground"))
    return sdf(*links, *joints, static=static)


CUBE = 0.2  # [m]


def cube(name: str, x: float, y: float, size: float = CUBE, mass: float = 1.0) -> str:
    """SDF of a link that is a cube on the ground."""
    shape = collision(box(f"{size} {size} {size}"))
    return sdf_link(name, f"{x} {y} {size / 2.0} 0 0 0", shape, mass, mass * size**2 / 6.0)


def weld(name: str, parent: str, child: str) -> str:
    """SDF of a fixed joint."""
    return sdf_joint(name, "fixed", parent, child)
