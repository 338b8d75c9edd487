"""Pieces of URDF and SDF, of which tests put small models together."""

WORLD = '<link name="world"/>'  # of a URDF that stands on it
LIMIT = 'lower="-1" upper="1" effort="1" velocity="1"'


def robot(*parts: str, name: str = "r") -> str:
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def _moments(moment: object) -> tuple[object, ...]:
    """Of inertia about x, y and z: three, or one for all."""
    return moment if isinstance(moment, tuple) else (moment,) * 3


def inertial(mass: object = 1.0, com: str = "0 0 0", moment: object = 0.1) -> str:
    x, y, z = _moments(moment)
    return (
        f'<inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        f'<inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def link(name: str, mass: object = 1.0, com: str = "0 0 0", moment: object = 0.1, more: str = "") -> str:
    return f'<link name="{name}">{inertial(mass, com, moment)}{more}</link>'


def joint(
    name: str, kind: str, parent: str, child: str, xyz: str = "0 0 0", more: str = "",
    axis: str = "0 0 1", limit: str = LIMIT,
) -> str:  # fmt: skip
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/><limit {limit}/>{more}</joint>'
    )


def sdf(*parts: str, version: str = "1.6", name: str = "m", static: bool = False) -> str:
    """A file with one model."""
    still = "<static>1</static>" * static
    return f'<sdf version="{version}"><model name="{name}">{still}{"".join(parts)}</model></sdf>'


def sdf_world(*parts: str, version: str = "1.6") -> str:
    return f'<sdf version="{version}"><world name="w">{"".join(parts)}</world></sdf>'


def sdf_link(
    name: str, pose: str = "0 0 0 0 0 0", more: str = "", mass: object = 1.0, moment: object = 0.1,
    com: str = "0 0 0",
) -> str:  # fmt: skip
    x, y, z = _moments(moment)
    return (
        f'<link name="{name}"><pose>{pose}</pose><inertial><pose>{com} 0 0 0</pose><mass>{mass}</mass>'
        f"<inertia><ixx>{x}</ixx><iyy>{y}</iyy><izz>{z}</izz></inertia></inertial>{more}</link>"
    )


def sdf_joint(
    name: str, kind: str, parent: str, child: str, axis: str = "0 0 1", pose: str = "", more: str = ""
) -> str:  # fmt: skip
    return (
        f'<joint name="{name}" type="{kind}">{pose}<parent>{parent}</parent><child>{child}</child>'
        f"<axis><xyz>{axis}</xyz>{more}</axis></joint>"
    )


def collision(shape: str, more: str = "", name: str = "c") -> str:
    """Of an SDF."""
    return f'<collision name="{name}"><geometry>{shape}</geometry>{more}</collision>'


def box(size: str) -> str:
    return f"<box><size>{size}</size></box>"


def ball(radius: object) -> str:
    return f"<sphere><radius>{radius}</radius></sphere>"
