"""What a package says: the template's files with the robot's own names and numbers."""

import math
import string
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

from package_writing.gains import Gains, effort_gains, velocity_gains, wheel_gains
from package_writing.survey import EFFORT, POSITION, Motor, Survey

TEMPLATE = Path(__file__).resolve().parent / "template"
PARTS = TEMPLATE.with_name("parts")  # of a xacro file that adds what a robot's own lacks
QUOTE = {'"': "&quot;"}
FILLED = ".in"  # the end of the names of files that have something to be filled in
PERIOD = 0.04  # [s] of an action


class Filled(string.Template):
    """Its sign is none that launch files, xacro or CMake use."""

    delimiter = "%"


def fill(folder: Path, package: str, values: Mapping[str, str]) -> None:
    """Writes the template's files, all but the robot that comes along.

    Args:
        folder: of the package.
        package: its name.
        values: what is filled in, by the names that the template has for it.
    """
    for source in sorted(TEMPLATE.rglob(f"*{FILLED}")):
        place = source.relative_to(TEMPLATE).with_suffix("")
        parts = [package if part == "package" else part for part in place.parts]
        target = folder.joinpath(*parts)
        target.parent.mkdir(parents=True, exist_ok=True)
        text = Filled(source.read_text(encoding="utf-8")).substitute(values)
        target.write_text(text, encoding="utf-8")


def controller(motor: Motor) -> str:
    """The name of a joint's controller."""
    return f"{motor.joint}_controller"


def controllers_text(survey: Survey) -> str:
    """The controllers, as YAML."""
    by_joint, of_wheels = effort_gains(survey.model), wheel_gains(survey.model)
    lines = []
    for motor in survey.motors:
        kind = motor.interface.removesuffix("JointInterface").lower()
        lines += [
            f"{controller(motor)}:",
            f"  type: {kind}_controllers/Joint{'Velocity' if motor.wheel else 'Position'}Controller",
            f"  joint: {motor.joint}",
        ]
        if motor.interface == EFFORT:
            gains = of_wheels if motor.wheel else by_joint
            lines.append(f"  pid: {_inline(gains[motor.joint])}  # {_units(motor)}")
        elif motor.interface != POSITION and not motor.wheel:
            lines.append(f"  pid: {_inline(velocity_gains())}  # [1/s]")
        lines.append("")
    unlimited = [motor.joint for motor in survey.motors if not motor.limited]
    if unlimited:
        lines += [
            "# The URDF's limits of effort and velocity are 0, which holds a joint.",
            "joint_limits:",
        ]
        lines += [
            f"  {joint}: {{has_effort_limits: false, has_velocity_limits: false}}"
            for joint in unlimited
        ]
        lines.append("")
    return "\n".join(lines)


def _inline(gains: Gains) -> str:
    return "{" + ", ".join(f"{name}: {value}" for name, value in gains.items()) + "}"


def _units(motor: Motor) -> str:
    if motor.wheel:
        return "[N m s/rad, N m/rad, N m s²/rad, N m]"
    effort, way = ("N", "m") if motor.linear else ("N m", "rad")
    return f"[{effort}/{way}, {effort}/({way} s), {effort} s/{way}, {effort}]"


def ranges_text(survey: Survey) -> str:
    """The postures to reach, as the inside of a Python dict."""
    return "".join(
        f'    "{motor.joint}": ({_inwards(motor.low, math.ceil)}, {_inwards(motor.high, math.floor)}),\n'
        for motor in survey.motors
    )


def _inwards(bound: float, rounded: Callable[[float], int]) -> float:
    """A bound with three decimals, within the range that it bounds."""
    return rounded(bound * 1000.0) / 1000.0


def wheels_text(survey: Survey) -> dict[str, str]:
    """What a task says of wheels, by the template's names for it; nothing, where there are none."""
    listed = "".join(f'    "{each.joint}",\n' for each in survey.motors if each.wheel)
    where = (
        '        """Where the joints are{}."""\n        return np.array([{} for joint in RANGES])'
    )
    if not listed:
        return {"wheels": "", "where": where.format("", "state.joints[joint].position")}
    told = (
        '        told = {joint: "velocity" if joint in WHEELS else "position" for joint in RANGES}'
    )
    text = where.format(
        "; of wheels, how fast they turn", "getattr(state.joints[joint], told[joint])"
    )
    return {
        "wheels": f"WHEELS = {{  # they are told a velocity, and reach one\n{listed}}}\n",
        "where": text.replace("\n", f"\n{told}\n"),
    }


def names_text(survey: Survey) -> str:
    """Joints and their controllers, as the inside of a Python dict."""
    return "".join(f'    "{each.joint}": "{controller(each)}",\n' for each in survey.motors)


def control_text(package: str, urdf: str, survey: Survey | None, loose: str) -> str:
    """A xacro file that includes the user's and adds what it lacks.

    Args:
        package: its name.
        urdf: the user's file, beside it.
        survey: of that file; None: there is none yet, and it gets no motors.
        loose: the link that has to be fixed to the world, if any.
    """
    parts = []
    if loose:
        parts.append(_part("fixed.xml.in", {"root": escape(loose, QUOTE)}))
    if survey is not None and survey.added:
        motors = "\n".join(
            f'  <xacro:motor joint={quoteattr(each.joint)} interface="{each.interface}"/>'
            for each in survey.motors
        )
        parts.append(_part("motors.xml.in", {"motors": motors}))
    if survey is not None and not survey.has_plugin:
        parts.append(_part("plugin.xml.in", {}))
    values = {"name": package, "urdf": escape(urdf, QUOTE), "parts": "".join(parts)}
    return _part("control.urdf.xacro.in", values)


def _part(name: str, values: Mapping[str, str]) -> str:
    return Filled((PARTS / name).read_text(encoding="utf-8")).substitute(values)
