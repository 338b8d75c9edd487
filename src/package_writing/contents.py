"""A package's files: the template filled with the robot's names and numbers, and initial gains."""

import json
import math
import re
import shlex
import string
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import escape

import yaml

from bullet_gazebo.physics.description import ModelDescription
from bullet_gazebo.physics.dynamics import effective_inertias, most_inertias, poses_at_zero
from bullet_gazebo.physics.pose import rotate
from package_writing import CannotWrite
from package_writing.standing import centre_of_mass, feet
from package_writing.survey import EFFORT, POSITION, Motor, Survey
from package_writing.vehicle import DRIVE, Base, scan_topic
from package_writing.vehicle import controller as drive_controller
from robot_envs.files import PACKAGE

# [rad/s], at least, of a joint on its p and d with all that it carries stretched out
FREQUENCY = 12.0
HIGHEST = 250.0  # [rad/s], of a joint's own inertia; steps of 1 ms can't follow a higher one
STIFFEST = 700.0  # [rad/s], likewise, of the p alone with which a leg balances its body
DAMPED = 350.0  # [rad/s], likewise, of its d alone
TRIPOD = 3  # feet that need no balance; on fewer i would feed the body's slow sway
MARGIN = 2.0  # of p over what lets a body tip over about a leg's joint
MOST = 25.0  # largest ratio of carried to own inertia
SAG = 0.1  # [rad, m], largest sag under its weight with p alone
SHARE = 0.05  # largest sag as a share of the joint's range
GRAVITY = 9.81  # [m/s²]
VELOCITY = 5.0  # [1/s], p if the output is a velocity

CLAMP = 5.0  # [rad/s], of a wheel: i gives at most what p gives at this velocity error

Gains = dict[str, float]


def effort_gains(model: ModelDescription) -> dict[str, Gains]:
    """Returns gains of position controllers with an effort as output, by joint.

    p and d make joint and load a critically damped spring, stiff enough for their weight; i, within its
    clamp, compensates gravity. The joints of legs carry the body, too.
    """
    carried = most_inertias(model)
    own = effective_inertias(model, poses_at_zero(model))
    below = _masses(model)
    stances = _stances(model, below)
    balancing = stances if len(feet(model)) < TRIPOD else {}
    found = {}
    for name, inertia in carried.items():
        ratio = min(inertia / own[name], MOST) if own[name] > 0.0 else 1.0
        moved = own[name] * ratio or inertia
        weight = GRAVITY * math.sqrt(below[name] * inertia)  # upper bound of the load [N m, N]
        joint = model.joints[name]
        sag = min(SAG, SHARE * (joint.upper - joint.lower)) if joint.bounded else SAG
        frequency = min(max(FREQUENCY, math.sqrt(weight / sag / moved)), HIGHEST / ratio)
        p, d = moved * frequency**2, 2.0 * moved * frequency
        stable = math.inf  # the largest i with which joint and load don't shake
        if name in stances:
            load, standing, tipping = stances[name]
            fastest = DAMPED if name in balancing else HIGHEST
            p = max(p, min(load / sag, own[name] * HIGHEST**2))
            p = max(p, min(MARGIN * tipping, own[name] * STIFFEST**2))
            d = max(d, min(2.0 * math.sqrt(p * standing), 2.0 * own[name] * fastest))
            weight = max(weight, load)
            stable = p * d / standing if standing else math.inf
        i = 0.0 if name in balancing else min(2.0 * p, stable / 2.0)
        found[name] = _rounded({"p": p, "i": i, "d": d, "i_clamp": weight})
    return found


def _stances(
    model: ModelDescription, below: Mapping[str, float]
) -> dict[str, tuple[float, float, float]]:
    """Returns load, inertia and m g h [N m, kg m², N m/rad] of legs' joints, half the feet on the ground.

    The body above a joint is an inverted pendulum, which a p of m g h or less lets fall.
    `below` is the mass that each joint carries with its foot in the air [kg].
    """
    poses, on = poses_at_zero(model), feet(model)
    top = centre_of_mass(model, poses)[2] if on else 0.0
    total = sum(each.inertia.mass for each in model.links.values() if each.inertia is not None)
    found = {}
    for foot in on:
        for joint in (each for each in model.carriers(foot) if each.movable):
            frame = poses[joint.child].compose(joint.anchor)
            x, y, z = rotate(frame.orientation, joint.axis)
            mass = (total - below[joint.name]) / max(1, len(on) // 2)
            if joint.kind == "prismatic":
                found[joint.name] = (GRAVITY * mass * abs(z), mass, 0.0)
            else:
                soles = [poses[foot].compose(each.pose) for each in model.links[foot].collisions]
                arm = max(math.dist(frame.position, each.position) for each in soles)
                height, level = max(0.0, float(top) - frame.position[2]), math.hypot(x, y)
                found[joint.name] = (
                    GRAVITY * mass * arm * level,
                    mass * max(arm, height) ** 2,
                    GRAVITY * mass * height * level,
                )
    return found


def wheel_gains(model: ModelDescription) -> dict[str, Gains]:
    """Returns gains of velocity controllers with an effort as output, by joint.

    p is as stiff as steps of 1 ms allow with the wheel in the air; i compensates slopes and friction.
    """
    found = {}
    for name, inertia in effective_inertias(model, poses_at_zero(model)).items():
        p = HIGHEST * inertia
        found[name] = _rounded({"p": p, "i": VELOCITY * p, "d": 0.0, "i_clamp": CLAMP * p})
    return found


def _masses(model: ModelDescription) -> dict[str, float]:
    """Returns the mass that each movable joint carries [kg]."""
    found = {}
    for joint in model.movable_joints:
        links = [joint.child]
        for name in links:
            links += [each.child for each in model.joints.values() if each.parent == name]
        inertias = [model.links[name].inertia for name in links]
        found[joint.name] = sum(each.mass for each in inertias if each is not None)
    return found


def _rounded(gains: Gains) -> Gains:
    return {name: float(f"{value:.3g}") for name, value in gains.items()}


TEMPLATE = Path(__file__).resolve().parent / "template"
PARTS = TEMPLATE.with_name("parts")  # of a xacro file that adds what the robot's file lacks
QUOTE = {'"': "&quot;"}
FILLED = ".in"  # suffix of template files with values to fill in
PERIOD = 0.04  # [s] of an action
STATES = "joint_state_controller"
DRIVE_PERIOD = 0.2  # [s] of one of a base


class Filled(string.Template):
    """A template with a delimiter that launch files, xacro and CMake don't use."""

    delimiter = "%"


def fill(folder: Path, package: str, values: Mapping[str, str], base: Base | None) -> None:
    """Writes the template's files, except the default robot, and those of the task.

    Args:
        folder: the package's folder.
        package: the package's name.
        values: the values to fill in, by their names in the template.
        base: what drives the robot.
    """
    tops = (TEMPLATE, TEMPLATE.with_name("drive" if base else "reach"))
    for top, source in ((each, file) for each in tops for file in sorted(each.rglob(f"*{FILLED}"))):
        place = source.relative_to(top).with_suffix("")
        parts = [package if part == "package" else part for part in place.parts]
        target = folder.joinpath(*parts)
        target.parent.mkdir(parents=True, exist_ok=True)
        text = Filled(source.read_text(encoding="utf-8")).substitute(values)
        target.write_text(text, encoding="utf-8")
        if text.startswith("#!"):
            target.chmod(target.stat().st_mode | 0o111)


def literal(text: str) -> str:
    """Returns a text in double quotes, as both Python and YAML read it."""
    return json.dumps(text, ensure_ascii=False)


def xacro_attribute(text: str) -> str:
    """Returns a text for an attribute in double quotes, in which xacro evaluates nothing."""
    return escape(text.replace("$(", "$$(").replace("${", "$${"), QUOTE)


def controller(motor: Motor) -> str:
    """Returns the name of a joint's controller: the joint's, as far as it makes a ROS name."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", motor.joint)
    return f"{name if name[:1].isalpha() else f'joint_{name}'}_controller"


def check_controllers(motors: Sequence[Motor], base: Base | None) -> None:
    """Raises CannotWrite if two controllers would have one name, those that every robot or a base has too."""
    joints: dict[str, str] = {}
    for motor in motors:
        name = controller(motor)
        if name == STATES or (base and name == DRIVE):
            raise CannotWrite(
                f"the controller of the joint {literal(motor.joint)} would be called {name}, as another one "
                "is; rename the joint"
            )
        other = joints.setdefault(name, motor.joint)
        if other != motor.joint:
            raise CannotWrite(
                f"the joints {literal(other)} and {literal(motor.joint)} would share the controller "
                f"{name}; rename one of them"
            )


def controllers_text(survey: Survey, base: Base | None) -> str:
    """Returns the controllers as YAML; of wheels, that of the base."""
    by_joint, of_wheels = effort_gains(survey.model), wheel_gains(survey.model)
    lines = []
    if base:
        described = {DRIVE: drive_controller(base)}
        lines += ["# Lengths in m, speeds in m/s and rad/s."]
        lines += [yaml.safe_dump(described, sort_keys=False, default_flow_style=None, width=120)]
    for motor in held_motors(survey, base):
        kind = motor.interface.removesuffix("JointInterface").lower()
        lines += [
            f"{controller(motor)}:",
            f"  type: {kind}_controllers/Joint{'Velocity' if motor.wheel else 'Position'}Controller",
            f"  joint: {literal(motor.joint)}",
        ]
        if motor.interface == EFFORT:
            gains = of_wheels if motor.wheel else by_joint
            lines.append(f"  pid: {_inline(gains[motor.joint])}  # {_units(motor)}")
        elif motor.interface != POSITION and not motor.wheel:
            lines.append(f"  pid: {_inline({'p': VELOCITY})}  # [1/s]")
        lines.append("")
    if unlimited := [motor.joint for motor in survey.motors if not motor.limited]:
        none = "{has_effort_limits: false, has_velocity_limits: false}"
        lines += [
            "# The URDF's limits of effort and velocity are 0, which holds a joint.",
            "joint_limits:",
            *(f"  {literal(joint)}: {none}" for joint in unlimited),
            "",
        ]
    return "\n".join(lines)


def _inline(gains: Gains) -> str:
    return "{" + ", ".join(f"{name}: {value}" for name, value in gains.items()) + "}"


def _units(motor: Motor) -> str:
    if motor.wheel:
        return "[N m s/rad, N m/rad, N m s²/rad, N m]"
    effort, way = ("N", "m") if motor.linear else ("N m", "rad")
    return f"[{effort}/{way}, {effort}/({way} s), {effort} s/{way}, {effort}]"


def held_motors(survey: Survey, base: Base | None) -> list[Motor]:
    """Returns the motors that have controllers of their own: all but the wheels of a base."""
    return [each for each in survey.motors if not (base and each.wheel)]


def base_text(package: str, survey: Survey, base: Base | None) -> dict[str, str]:
    """Returns the template's values about a base that drives."""
    rviz, world = "", "worlds/empty.world"
    if base is None:
        run = "tuple(CONTROLLERS.values())"
        return {"task": "Reach", "run_python": run, "base": "", "rviz": rviz, "world": world}
    lines = [f'    odometry="{DRIVE}/odom",']
    if base.world:
        lines.append(f'    world="{PACKAGE}cartpole/{base.world}",')
        world = f"$(find cartpole)/{base.world}"
        if any(each.interface == EFFORT for each in held_motors(survey, base)):
            lines.append("    physics_step=0.001,  # [s]: the gains are for it")
    if base.laser:
        scan = escape(scan_topic(base.laser, survey.namespace, package), QUOTE)
        rviz = f"""
      <arg name="sensors" value="true"/>
      <arg name="scan" value="{scan}"/>"""
    return {
        "task": "Drive", "run_python": f'("{DRIVE}", *CONTROLLERS.values())', "rviz": rviz, "world": world,
        "base": "\n".join(["", f'    commanded=("{DRIVE}",),', *lines]),
        "laser": literal(base.laser.name) if base.laser else "None",
        "touch": str(base.touch), "clearance": str(base.clearance),
        "seen": " that its laser sees" if base.laser else ": it has no laser, and sees nothing",
    }  # fmt: skip


def ranges_text(survey: Survey, starts: Mapping[str, float]) -> str:
    """Returns the ranges of the postures to reach, the stance included, as the inside of a Python dict."""
    starting = [(each, starts.get(each.joint, 0.0)) for each in survey.motors]  # wheels at 0
    return "".join(
        f"    {literal(each.joint)}: ({min(each.low, start)}, {max(each.high, start)}),\n"
        for each, start in starting
    )


def goals_text(survey: Survey, starts: Mapping[str, float]) -> str:
    """Returns where a test moves joints, and how near, as the inside of a Python dict.

    It goes a quarter of the way up from where a joint starts; on a free base, which might fall, nowhere. The
    legs of one that balances sag: they have no i.
    """
    least = SAG / 2.0 if 0 < len(feet(survey.model)) < TRIPOD else 0.0
    share = 0.25 if survey.model.fixed_base else 0.0
    lines = []
    for motor in (each for each in survey.motors if not each.wheel):
        start = starts.get(motor.joint, 0.0)
        goal = start + share * (motor.high - start)
        near = max(0.025 * (motor.high - motor.low), least)
        lines.append(f"    {literal(motor.joint)}: ({goal:.3g}, {near:.3g}),\n")
    return "".join(lines)


def stance_text(package: str, survey: Survey, starts: Mapping[str, float]) -> dict[str, str]:
    """Returns the template's values about where joints start, and a test that what has feet stands."""
    options = "".join(f" -J {shlex.quote(name)} {start}" for name, start in starts.items())
    stands = bool(feet(survey.model))
    return {
        "stance": "".join(f"    {literal(name)}: {start},\n" for name, start in starts.items()),
        "joints": escape(options, QUOTE),
        "stands": (PARTS / "stands.py.in").read_text(encoding="utf-8") if stands else "",
        "stands_checked": ", check_stands" if stands else "",
        "stands_imported": f"\nfrom {package}.robot import ROBOT, STANCE" if stands else "",
    }


def wheels_text(survey: Survey) -> dict[str, str]:
    """Returns the template's values about wheels; empty if there are no wheels."""
    listed = "".join(f"    {literal(each.joint)},\n" for each in survey.motors if each.wheel)
    where = (
        '        """Where the joints are{}."""\n        return np.array([{} for joint in RANGES])'
    )
    if not listed:
        return {"wheels": "", "where": where.format("", "state.joints[joint].position")}
    kinds = (
        '        kinds = {joint: "velocity" if joint in WHEELS else "position" for joint in RANGES}'
    )
    text = where.format(
        "; of wheels, how fast they turn", "getattr(state.joints[joint], kinds[joint])"
    )
    return {
        "wheels": f"WHEELS = {{  # commanded by velocity\n{listed}}}\n",
        "where": text.replace("\n", f"\n{kinds}\n"),
    }


def control_text(package: str, urdf: str, survey: Survey | None, loose: str) -> str:
    """Returns a xacro file that includes the user's file and adds what it lacks.

    Args:
        package: the package's name.
        urdf: the user's file, in the same folder.
        survey: of that file; None if not known yet, so that no motors are added.
        loose: the link to fix to the world; "" for none.
    """
    parts = []
    if loose:
        parts.append(_part("fixed.xml.in", {"root": xacro_attribute(loose)}))
    if survey is not None and survey.added:
        motors = "\n".join(
            f'  <xacro:motor joint="{xacro_attribute(each.joint)}" interface="{each.interface}"/>'
            for each in survey.motors
        )
        parts.append(_part("motors.xml.in", {"motors": motors}))
    if survey is not None and not survey.has_plugin:
        parts.append(_part("plugin.xml.in", {}))
    values = {"name": package, "urdf": xacro_attribute(urdf), "parts": "".join(parts)}
    return _part("control.urdf.xacro.in", values)


def _part(name: str, values: Mapping[str, str]) -> str:
    return Filled((PARTS / name).read_text(encoding="utf-8")).substitute(values)
