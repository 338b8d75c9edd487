"""Hypothesis strategies for the texts of robots in URDF, models in SDF 1.4 to 1.7, and worlds."""

from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st
from support.robots.snippets import ball, box, sdf_joint, sdf_world

Draw = Callable[[st.SearchStrategy[Any]], Any]

NAMES = ["base", "base_link", "arm", "arm_tip", "tip", "left", "wheel", "a", "ab", "hull"]
NUMBERS = st.floats(-2.0, 2.0).map(lambda value: round(value, 3))
THREE = st.tuples(NUMBERS, NUMBERS, NUMBERS)
SIX = st.tuples(*[NUMBERS] * 6)
POSITIVE = st.floats(0.1, 9.0).map(lambda value: round(value, 3))
SENSORS = ("camera", "imu", "ray", "contact", "gps", "depth", "sonar")
AXES = ("1 0 0", "0 1 0", "0 0 1", "0.6 0 -0.8", "0 3 0")
FLAGS = ("true", "false", "1", "0")


def words(numbers: tuple[float, ...]) -> str:
    return " ".join(map(str, numbers))


def sensor(draw: Draw, name: str) -> str:
    pose = f"<pose>{words(draw(SIX))}</pose>" if draw(st.booleans()) else ""
    rate = f"<update_rate>{draw(POSITIVE)}</update_rate>" if draw(st.booleans()) else ""
    return f'<sensor name="{name}" type="{draw(st.sampled_from(SENSORS))}">{pose}{rate}</sensor>'


def moments(draw: Draw) -> tuple[float, float, float]:
    """Moments of inertia of a body whose mass has these about its axes."""
    x, y, z = draw(st.tuples(*[st.floats(0.1, 1.0)] * 3))
    return y + z, x + z, x + y


@st.composite
def urdf_robots(draw: Draw) -> str:
    """URDF of a tree of links, some of them joined by fixed joints or to the world."""
    links = draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=7, unique=True))
    joints = draw(st.permutations([f"{letter}_joint" for letter in "bacfed"]))
    parts, moved = [], []
    for number, link in enumerate(links):
        xx, yy, zz = moments(draw)
        parts.append(
            f'<link name="{link}"><inertial><origin xyz="{words(draw(THREE))}" rpy="{words(draw(THREE))}"/>'
            f'<mass value="{draw(st.floats(0.1, 9.0))}"/><inertia ixx="{xx}" iyy="{yy}" izz="{zz}"'
            f' ixy="0" ixz="0" iyz="0"/></inertial>{_urdf_shapes(draw)}</link>'
        )
        if draw(st.integers(0, 2)) == 0:
            parts.append(
                f'<gazebo reference="{link}">{sensor(draw, f"sensor_{number}")}'
                f"<turnGravityOff>{draw(st.sampled_from(FLAGS))}</turnGravityOff></gazebo>"
            )
        if number:
            parent, name = links[draw(st.integers(0, number - 1))], joints[number - 1]
            parts += _urdf_joint(draw, name, parent, link, moved)
    if draw(st.integers(0, 2)) == 0:
        kind = draw(st.sampled_from(["fixed", "fixed", "revolute"]))
        parts += ['<link name="world"/>', *_urdf_joint(draw, "anchor", "world", links[0], [], kind)]
    return f'<robot name="drawn">{"".join(draw(st.permutations(parts)))}</robot>'


def _urdf_shapes(draw: Draw) -> str:
    cylinder = '<cylinder radius="0.1" length="2"/>'
    solids = '<box size="0.1 0.2 0.3"/>', '<sphere radius="0.4"/>', cylinder
    shapes = []
    for tag in ("collision", "visual"):
        for own in draw(st.lists(st.sampled_from(["", *NAMES]), max_size=2)):
            name = f' name="{own}"' if own else ""
            shapes.append(
                f'<{tag}{name}><origin xyz="{words(draw(THREE))}" rpy="{words(draw(THREE))}"/>'
                f"<geometry>{draw(st.sampled_from(solids))}</geometry></{tag}>"
            )
    return "".join(shapes)


def _urdf_joint(
    draw: Draw, name: str, parent: str, child: str, moved: list[str], kind: str = ""
) -> list[str]:
    """A joint and what <gazebo> says of it; `moved` are the joints before it that can lead a follower."""
    kind = kind or draw(st.sampled_from(["fixed", "fixed", "revolute", "continuous", "prismatic"]))
    more = ""
    if kind != "fixed":
        if draw(st.booleans()):
            more += f'<dynamics damping="{draw(POSITIVE)}" friction="{draw(POSITIVE)}"/>'
        if moved and draw(st.booleans()):
            more += f'<mimic joint="{draw(st.sampled_from(moved))}" multiplier="-2" offset="0.1"/>'
        moved.append(name)
    low, high = sorted(draw(st.tuples(NUMBERS, NUMBERS)))
    found = [
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words(draw(THREE))}" rpy="{words(draw(THREE))}"/>'
        f'<axis xyz="{draw(st.sampled_from(AXES))}"/>'
        f'<limit lower="{low}" upper="{high}" effort="{draw(POSITIVE)}" velocity="{draw(POSITIVE)}"/>'
        f"{more}</joint>"
    ]
    if kind == "fixed" and parent != "world" and draw(st.integers(0, 3)) == 0:
        keep = draw(st.sampled_from(["preserveFixedJoint", "disableFixedJointLumping"]))
        found.append(f'<gazebo reference="{name}"><{keep}>true</{keep}></gazebo>')
    for tag in draw(st.lists(st.sampled_from(["springStiffness", "springReference"]))):
        spring = draw(st.sampled_from(["<{0}> {1} </{0}>", '<{0} value="{1}"/>']))
        found.append(f'<gazebo reference="{name}">{spring.format(tag, draw(NUMBERS))}</gazebo>')
    return found


@st.composite
def sdf_models(draw: Draw) -> str:
    """SDF of one model: a tree of links, with a nested model, frames and sensors."""
    version = draw(st.sampled_from(["1.4", "1.5", "1.6", "1.7"]))
    return f'<sdf version="{version}">{_sdf_model(draw, version, "drawn")}</sdf>'


def _sdf_model(draw: Draw, version: str, name: str, depth: int = 1) -> str:
    links = draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=5, unique=True))
    parts, known = [], ["__model__"] if version == "1.7" else []
    ends = list(links)  # of joints: those of nested models, too
    if depth and version != "1.4" and draw(st.booleans()):
        if draw(st.booleans()):
            inner = _sdf_model(draw, version, "inner", depth - 1)
            ends.append("inner::" + inner.partition('<link name="')[2].partition('"')[0])
        else:
            named = f"<name>inner</name>{_pose(draw, version, [])}"
            inner = f"<include><uri>model://crate</uri>{named}</include>"
            ends.append("inner::body")
        parts.append(inner)
    for number, link in enumerate(links):
        parts.append(
            f'<link name="{link}">{_pose(draw, version, known)}{_sdf_inertial(draw)}'
            f"<gravity>{draw(st.sampled_from(FLAGS))}</gravity>{_sdf_shapes(draw, version, known)}"
            f"{sensor(draw, f'sensor_{number}') if draw(st.booleans()) else ''}</link>"
        )
        known.append(link)
    if version == "1.7" and draw(st.booleans()):
        attached = f' attached_to="{draw(st.sampled_from(links))}"' if draw(st.booleans()) else ""
        parts.append(f'<frame name="extra"{attached}>{_pose(draw, version, known)}</frame>')
        known.append("extra")
    if depth and ends == links and draw(st.integers(0, 3)) == 0:  # we have it first in any case
        parts.append(sdf_joint("anchor", "fixed", "world", links[0]))
    for number in range(1, len(ends)):
        parent = ends[draw(st.integers(0, number - 1))]
        parts.append(_sdf_joint(draw, version, f"joint_{number}", parent, ends[number], known))
    return f'<model name="{name}">{_pose(draw, version, [])}{"".join(parts)}</model>'


def _pose(draw: Draw, version: str, frames: list[str]) -> str:
    if draw(st.booleans()):
        return ""
    relative = ""
    if frames and version != "1.4" and draw(st.booleans()):
        key = "relative_to" if version == "1.7" else "frame"
        relative = f' {key}="{draw(st.sampled_from(frames))}"'
    return f"<pose{relative}>{words(draw(SIX))}</pose>"


def _sdf_inertial(draw: Draw) -> str:
    xx, yy, zz = moments(draw)
    return (
        f"<inertial><pose>{words(draw(SIX))}</pose><mass>{draw(POSITIVE)}</mass>"
        f"<inertia><ixx>{xx}</ixx><iyy>{yy}</iyy><izz>{zz}</izz></inertia></inertial>"
    )


def _sdf_shapes(draw: Draw, version: str, frames: list[str]) -> str:
    cylinder = "<cylinder><radius>0.1</radius><length>2</length></cylinder>"
    solids = box("0.1 0.2 0.3"), ball(0.4), cylinder
    shapes = []
    for tag in ("collision", "visual"):
        for name in draw(st.lists(st.sampled_from(NAMES), max_size=2, unique=True)):
            pose = _pose(draw, version, frames)
            solid = draw(st.sampled_from(solids))
            shapes.append(f'<{tag} name="{name}">{pose}<geometry>{solid}</geometry></{tag}>')
    return "".join(shapes)


def _sdf_joint(draw: Draw, version: str, name: str, parent: str, child: str, frames: list[str]) -> str:
    kind = draw(st.sampled_from(["fixed", "revolute", "prismatic"]))
    pose = _pose(draw, version, frames)
    axis = ""
    if kind != "fixed":
        expressed, inner, limits = "", "", ""
        if version == "1.7" and draw(st.booleans()):
            expressed = f' expressed_in="{draw(st.sampled_from(frames))}"'
        if version in ("1.5", "1.6") and draw(st.booleans()):
            truth = draw(st.sampled_from(FLAGS))
            inner = f"<use_parent_model_frame>{truth}</use_parent_model_frame>"
        if draw(st.booleans()):
            low, high = sorted(draw(st.tuples(NUMBERS, NUMBERS)))
            limits = f"<lower>{low}</lower><upper>{high}</upper>"
        if draw(st.booleans()):
            limits += f"<effort>{draw(POSITIVE)}</effort><velocity>{draw(POSITIVE)}</velocity>"
        dynamics = f"<damping>{draw(POSITIVE)}</damping><friction>{draw(POSITIVE)}</friction>"
        dynamics += f"<spring_stiffness>{draw(POSITIVE)}</spring_stiffness>"
        axis = (
            f"<axis><xyz{expressed}>{draw(st.sampled_from(AXES))}</xyz>{inner}"
            f"<limit>{limits}</limit><dynamics>{dynamics}</dynamics></axis>"
        )
    return (
        f'<joint name="{name}" type="{kind}">{pose}<parent>{parent}</parent><child>{child}</child>'
        f"{axis}</joint>"
    )


@st.composite
def worlds(draw: Draw, folders: tuple[str, ...]) -> str:
    """SDF of a world with models, includes of models in `folders`, lights, gravity and physics."""
    version = draw(st.sampled_from(["1.4", "1.5", "1.6", "1.7"]))
    parts = []
    for number in range(draw(st.integers(0, 2))):
        parts.append(_sdf_model(draw, version, f"model_{number}", depth=0))
    for number, folder in enumerate(draw(st.lists(st.sampled_from(folders), max_size=3))):
        pose = f"<pose>{words(draw(SIX))}</pose>" if draw(st.booleans()) else ""
        named = f"<name>included_{number}</name>{pose}"
        parts.append(f"<include><uri>model://{folder}</uri>{named}</include>")
    for kind in draw(st.lists(st.sampled_from(["point", "directional", "spot"]), unique=True)):
        direction = "" if kind == "point" else "<direction>0 0.6 -0.8</direction>"
        color = words(draw(st.tuples(*[st.integers(0, 8).map(lambda n: n / 8)] * 4)))
        parts.append(
            f'<light name="{kind}_light" type="{kind}"><pose>{words(draw(SIX))}</pose>'
            f"<cast_shadows>{draw(st.sampled_from(FLAGS))}</cast_shadows><diffuse>{color}</diffuse>"
            f"<attenuation><range>10</range><constant>0.5</constant><linear>0.25</linear></attenuation>"
            f"{direction}</light>"
        )
    gravity = f"<gravity>{words(draw(THREE))}</gravity>"
    step = draw(st.sampled_from(["0.001", "0.002", "0.0005"]))
    rate = draw(st.sampled_from(["1000", "500", "0"]))
    physics = (
        f'<physics type="ode">{gravity if version == "1.4" else ""}<max_step_size>{step}</max_step_size>'
        f"<real_time_update_rate>{rate}</real_time_update_rate></physics>"
    )
    parts += [physics] if draw(st.booleans()) else []
    parts += [gravity] if version != "1.4" and draw(st.booleans()) else []
    return sdf_world(*parts, version=version)
