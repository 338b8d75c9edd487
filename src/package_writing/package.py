"""The package for a robot, and the report on it."""

import math
import os
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from package_writing import CannotWrite, contents
from package_writing.gains import VELOCITY, effort_gains, wheel_gains
from package_writing.standing import feet, gait, stance, standing_height
from package_writing.survey import EFFORT, Survey, height_note, look_at, root_link
from package_writing.trial import stands_note, try_out
from package_writing.urdf_files import Copied, copy_urdf, expanded
from package_writing.vehicle import DRIVE, find_base, scan_topic
from robot_envs import Robot, RobotEnvError, controllers, files
from robot_sim.physics.files.reading import Resources

TREE = Path(__file__).resolve().parents[2]  # the source tree
IS_CHECKOUT = (TREE / "ws").is_file()
PARENT = TREE.parent if IS_CHECKOUT else Path()
"""Where packages are written by default: next to the checkout."""

INTERFACES = ("effort", "position", "velocity")
ARM = contents.TEMPLATE / "urdf/two_link_arm.urdf.xacro"
UNITS = ("rad", "m", "rad/s")
OURS = ("cartpole", "controller_manager", "gazebo_ros", "xacro")  # the template depends on them


@dataclass(frozen=True)
class PackageRequest:
    """The user's request for a package, by the options of new_robot.py."""

    name: str
    folder: Path
    urdf: Path | None
    arguments: Mapping[str, str]
    base: str | None
    height: float | None
    interface: str | None
    passive: tuple[str, ...] = ()
    standalone: bool = False
    walks: bool = False


def read_arguments(texts: Sequence[str]) -> dict[str, str]:
    """Parses xacro's arguments; raises CannotWrite if one isn't NAME:=VALUE."""
    arguments = {}
    for text in texts:
        name, sign, value = text.partition(":=")
        if not sign or not re.fullmatch(r"\w+", name):
            raise CannotWrite(f"'{text}' is not an argument of xacro (NAME:=VALUE)")
        arguments[name] = value
    return arguments


def write(request: PackageRequest, made: Path) -> str:
    """Writes the package into an empty folder; returns the report. Raises CannotWrite if it can't."""
    if request.height is not None and not math.isfinite(request.height):
        raise CannotWrite(f"--height is a number of metres, not {request.height}")
    copied = copy_urdf(request.urdf or ARM, request.arguments, request.name, made, request.standalone)
    if request.standalone:
        request = replace(request, arguments={})
    if not re.fullmatch(r"[\w .+@,=/-]+", copied.place):  # it stands in launch files and in Python
        raise CannotWrite(f"rename the file {copied.place!r}: letters, digits, blanks and . + @ , = - only")
    for name in copied.packages:
        if _package(name) is None:
            raise CannotWrite(
                f"it names the package '{name}', which isn't found: ./ws --with FOLDER rosrun cartpole "
                "new_robot.py ..., where FOLDER has that package"
            )
    loose = _loose_link(request, root_link(copied.xml), request.urdf or ARM)
    urdf, xml, survey = _completed(request, copied, made, loose)
    values = _values(request, copied, survey, urdf)
    contents.check_controllers(values["held"], values["base"])
    contents.fill(made, request.name, values)
    parameters = yaml.safe_load((made / "config/controllers.yaml").read_text(encoding="utf-8"))
    run = tuple(values["run"])
    robot = Robot(urdf=xml, controllers=parameters, run=run)
    movable = [each.name for each in survey.model.movable_joints]
    wrong = list(controllers.faults(run, None, parameters, robot.hardware(), movable))
    if wrong:
        raise CannotWrite("; ".join(wrong))
    on, notes = values["feet"], []
    faults = try_out(request.name, values["env_id"], made, stands=bool(on))
    if not survey.model.fixed_base:
        notes.append(height_note(values["height"], standing_height(survey.model, values["starts"])))
    if on:
        notes.append(stands_note(on, faults))
    near = request.folder.parent == PARENT
    return contents.render(
        "report.in",
        **values,
        lacks=list(_lacks(survey, loose)),
        stand_notes=notes,
        checkout=f"in {TREE}, " if IS_CHECKOUT else "",
        here=os.path.relpath(request.folder, TREE) if near else shlex.quote(str(request.folder)),
        folders=list(_others(copied)),
    ).rstrip("\n")


def _completed(request: PackageRequest, copied: Copied, made: Path, loose: str) -> tuple[str, str, Survey]:
    """Writes a file that adds what the robot's own lacks; returns the one to use, its XML and the survey."""
    others = files.resources()
    resources = Resources(package=lambda name: str(made) if name == request.name else others.package(name))
    interface = f"{request.interface.capitalize()}JointInterface" if request.interface else None
    free = request.base == "free"
    control = f"{request.name}_control.urdf.xacro"
    if (made / "urdf" / control).exists():
        raise CannotWrite(f"the package has a urdf/{control} of its own: rename that file, or the package")

    def with_more(survey: Survey | None) -> str:
        text = contents.render(
            "control.urdf.xacro.in", name=request.name, urdf=copied.place, survey=survey, loose=loose
        )
        (made / "urdf" / control).write_text(text, encoding="utf-8")
        return expanded(made / "urdf" / control, request.arguments)

    urdf, xml = copied.place, copied.xml
    if loose:  # a base without mass can't be simulated until it is fixed
        urdf, xml = control, with_more(None)
    survey = look_at(xml, interface, resources, free=free, passive=request.passive)
    added, has_plugin = survey.added, survey.has_plugin
    if added or not has_plugin:
        urdf, xml = control, with_more(survey)
        survey = look_at(xml, interface, resources, free=free)
    return urdf, xml, replace(survey, added=added, has_plugin=has_plugin)


def _loose_link(request: PackageRequest, root: str, source: Path) -> str:
    """Returns the link to fix to the world; "" for none."""
    if root == "world" or request.base == "free":
        return ""
    if request.base == "fixed":
        return root
    raise CannotWrite(
        f"{source}: nothing fixes its link '{root}' to the world: --base fixed does (an arm), --base free "
        "lets it stand or fall (a vehicle, a walker; --height says from where)"
    )


def _package(name: str) -> Path | None:
    try:
        return files.locate(f"{files.PACKAGE}{name}/package.xml").parent
    except RobotEnvError:
        return None


def _values(request: PackageRequest, copied: Copied, survey: Survey, urdf: str) -> dict[str, Any]:
    """Returns what the templates say of a robot, by the names that they have for it."""
    model, name, base = survey.model, request.name, find_base(survey)
    held = [each for each in survey.motors if not (base and each.wheel)]  # by their own controllers
    starts, height = stance(model), request.height
    if height is None:
        height = 0.0 if model.fixed_base else standing_height(model, starts) or 0.0
    on = feet(model)
    if request.walks and not on:
        raise CannotWrite(
            "--task walk: it has no legs to stand on: it is fixed, or stands on wheels or its base"
        )
    task, algo = ("Drive", "sac") if base else ("Walk", "ppo") if request.walks else ("Reach", "ppo")
    imus = (each.name for each in model.sensors if each.kind == "imu")
    gains = {True: wheel_gains(model), False: effort_gains(model)}
    return {
        "name": name, "urdf": urdf, "arguments": request.arguments, "folder": request.folder,
        "needed": [each for each in copied.packages if each not in OURS], "outside": copied.outside,
        "survey": survey, "base": base, "held": held, "feet": on, "starts": starts, "height": height,
        "drive": DRIVE, "run": [DRIVE] * bool(base) + [each.controller for each in held],
        "task": task, "algo": algo, "env_id": f"{name}.environment:{name}/{task}-v0",
        "gains": {e.joint: gains[e.wheel][e.joint] for e in held if e.interface == EFFORT},
        "gait": gait(model, on) if request.walks else {}, "imu": next(imus, None),
        "velocity_gain": VELOCITY, "goals": contents.goals(survey, starts),
        "ranges": {  # the stance included; wheels start at 0
            each.joint: (min(each.low, start), max(each.high, start))
            for each in survey.motors for start in [starts.get(each.joint, 0.0)]
        },
        "units": ", ".join(each for each in UNITS if each in {motor.unit for motor in survey.motors}),
        "scan": scan_topic(base.laser, survey.namespace, name) if base and base.laser else "",
    }  # fmt: skip


def _lacks(survey: Survey, loose: str) -> Iterator[str]:
    """Yields what the robot's file lacks."""
    if loose:
        yield f"a joint that fixes '{loose}' to the world"
    if survey.added:
        interfaces = dict.fromkeys(each.interface for each in survey.motors)
        yield f"transmissions ({', '.join(interfaces)})"
    if not survey.has_plugin:
        yield "ros_control's plugin"


def _others(copied: Copied) -> Iterator[str]:
    """Yields folders passed to ws that hold packages which the robot needs."""
    needed = [path.resolve() for each in copied.packages if (path := _package(each)) is not None]
    for folder in filter(None, os.environ.get("CARTPOLE_WITH", "").split(":")):
        if any(path.is_relative_to(Path(folder).resolve()) for path in needed):
            yield shlex.quote(folder)
