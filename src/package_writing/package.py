"""Writes one package, and reports its contents."""

import json
import math
import os
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import escape

import yaml

from bullet_gazebo.physics.files.reading import Resources
from package_writing import CannotWrite, contents
from package_writing.standing import feet, stance, standing_height
from package_writing.survey import Survey, height_note, look_at, root_link
from package_writing.trial import stands_note, try_out
from package_writing.urdf_files import Copied, copy_urdf, expanded
from package_writing.vehicle import DRIVE, Base, find_base
from robot_envs import Robot, RobotEnvError, controllers, files

TREE = Path(__file__).resolve().parents[2]  # the source tree
IS_CHECKOUT = (TREE / "ws").is_file()
PARENT = TREE.parent if IS_CHECKOUT else Path()
"""Where packages are written by default: next to the checkout."""

INTERFACES = ("effort", "position", "velocity")
ARM = contents.TEMPLATE / "urdf/two_link_arm.urdf.xacro"
NOTES = 3  # largest number of a URDF's warnings to show
OURS = ("cartpole", "controller_manager", "gazebo_ros", "xacro")  # the template depends on them


@dataclass(frozen=True)
class PackageRequest:
    """The user's request for a package.

    Args:
        name: the package's name.
        folder: its destination.
        urdf: the robot's file; None for a two-link arm.
        arguments: xacro's arguments.
        base: "fixed" or "free", for a robot that isn't fixed to the world; None if not given.
        height: where to spawn it [m]; None for 0, or so that a free base stands on the ground.
        interface: of joints without transmissions; None for velocity on wheels and effort on others.
        passive: joints that get no motor, if none has a transmission.
        standalone: whether its URDF is written expanded, with all meshes.
    """

    name: str
    folder: Path
    urdf: Path | None
    arguments: Mapping[str, str]
    base: str | None
    height: float | None
    interface: str | None
    passive: tuple[str, ...] = ()
    standalone: bool = False


def read_arguments(texts: Sequence[str]) -> dict[str, str]:
    """Parses xacro's arguments; raises CannotWrite if one isn't NAME:=VALUE."""
    found = {}
    for text in texts:
        name, sign, value = text.partition(":=")
        if not sign or not re.fullmatch(r"\w+", name):
            raise CannotWrite(f"'{text}' is not an argument of xacro (NAME:=VALUE)")
        found[name] = value
    return found


def write(request: PackageRequest, made: Path) -> list[str]:
    """Writes the package into an empty folder.

    Returns:
        Lines to print.

    Raises:
        CannotWrite: if the robot can't be read, simulated or moved.
    """
    if request.height is not None and not math.isfinite(request.height):
        raise CannotWrite(f"--height is a number of metres, not {request.height}")
    copied = copy_urdf(
        request.urdf or ARM, request.arguments, request.name, made, request.standalone
    )
    if request.standalone:
        request = replace(request, arguments={})
    if not re.fullmatch(r"[\w .+@,=/-]+", copied.place):  # it stands in launch files and in Python
        raise CannotWrite(
            f"rename the file {copied.place!r}: letters, digits, blanks and . + @ , = - only"
        )
    for name in copied.packages:
        if _package(name) is None:
            raise CannotWrite(
                f"it names the package '{name}', which isn't found: ./ws --with FOLDER rosrun cartpole "
                "new_robot.py ..., where FOLDER has that package"
            )
    loose = _loose_link(request, root_link(copied.xml), request.urdf or ARM)
    urdf, xml, survey, lacks = _completed(request, copied, made, loose)
    base = find_base(survey)
    held = contents.held_motors(survey, base)
    contents.check_controllers(held, base)
    starts = stance(survey.model)
    stands = None if survey.model.fixed_base else standing_height(survey.model, starts)
    if request.height is None:
        request = replace(request, height=stands or 0.0)
    values = _values(request, survey, base, urdf, copied, starts)
    contents.fill(made, request.name, values, base)
    parameters = yaml.safe_load((made / "config/controllers.yaml").read_text(encoding="utf-8"))
    run = tuple(values["run"].split())
    robot = Robot(urdf=xml, controllers=parameters, run=run)
    movable = [each.name for each in survey.model.movable_joints]
    wrong = list(controllers.faults(run, None, parameters, robot.hardware(), movable))
    if wrong:
        raise CannotWrite("; ".join(wrong))
    on = feet(survey.model)
    env_id = f"{request.name}.environment:{request.name}/{values['task']}-v0"
    faults = try_out(request.name, env_id, made, stands=bool(on))
    note = stands_note(on, faults) if on else ""
    more = f"urdf/{urdf}, which includes it, adds {' and '.join(lacks)}" if lacks else ""
    return list(_report(request, copied, survey, base, more, stands, note))


def _completed(
    request: PackageRequest, copied: Copied, made: Path, loose: str
) -> tuple[str, str, Survey, list[str]]:
    """Surveys the robot, and writes a file that adds what its own lacks.

    Returns:
        The file to use, in the folder urdf; its XML; the survey; and what was lacking.
    """
    others = files.resources()
    resources = Resources(
        package=lambda name: str(made) if name == request.name else others.package(name)
    )
    interface = f"{request.interface.capitalize()}JointInterface" if request.interface else None
    free = request.base == "free"
    control = f"{request.name}_control.urdf.xacro"
    if (made / "urdf" / control).exists():
        raise CannotWrite(
            f"the package has a urdf/{control} of its own: rename that file, or the package"
        )

    def with_more(survey: Survey | None) -> str:
        text = contents.control_text(request.name, copied.place, survey, loose)
        (made / "urdf" / control).write_text(text, encoding="utf-8")
        return expanded(made / "urdf" / control, request.arguments)

    urdf, xml = copied.place, copied.xml
    if loose:  # a base without mass can't be simulated until it is fixed
        urdf, xml = control, with_more(None)
    survey = look_at(xml, interface, resources, free=free, passive=request.passive)
    lacks, added = list(_lacks(survey, loose)), survey.added
    if added or not survey.has_plugin:
        urdf, xml = control, with_more(survey)
        survey = replace(look_at(xml, interface, resources, free=free), added=added)
    return urdf, xml, survey, lacks


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


def _values(
    request: PackageRequest,
    survey: Survey,
    base: Base | None,
    urdf: str,
    copied: Copied,
    starts: Mapping[str, float],
) -> dict[str, str]:
    needed = [each for each in copied.packages if each not in OURS]
    held = contents.held_motors(survey, base)
    pairs = [f"{name}:={value}" for name, value in request.arguments.items()]
    units = {"rad/s" if each.wheel else "m" if each.linear else "rad" for each in survey.motors}
    given = json.dumps(request.arguments, ensure_ascii=False)
    others = ", ".join(f"`{each}`" for each in needed)
    if others:
        others = f"`FOLDER` has what the robot needs of other packages: {others}.\n\n"
    return {
        "name": request.name,
        "urdf": urdf,
        "dependencies": "".join(f"  <exec_depend>{each}</exec_depend>\n" for each in needed),
        "controllers": "".join(
            f'    {contents.literal(each.joint)}: "{contents.controller(each)}",\n' for each in held
        ),
        "controllers_yaml": contents.controllers_text(survey, base),
        **contents.base_text(request.name, survey, base),
        "ranges": contents.ranges_text(survey, starts),
        "goals": contents.goals_text(survey, starts),
        **contents.stance_text(request.name, survey, starts),
        "units": ", ".join(each for each in ("rad", "m", "rad/s") if each in units),
        **contents.wheels_text(survey),
        "run": " ".join([DRIVE] * bool(base) + list(map(contents.controller, held))),
        "arguments": f"\n    arguments={given}," if pairs else "",
        "launch_arguments": "".join(
            f" {escape(shlex.quote(each), contents.QUOTE)}" for each in pairs
        ),
        "namespace": f'\n    namespace="{ns}",' if (ns := survey.namespace) else "",
        "ns": ns,
        "height": str(request.height),
        "period": str(contents.DRIVE_PERIOD if base else contents.PERIOD),
        "commands": "\n".join(
            _commands(request.name, base, f"../{request.name}", ["FOLDER"] * bool(needed))
        ),
        "folder": others,
    }


def _lacks(survey: Survey, loose: str) -> Iterator[str]:
    """Yields what the robot's file lacks."""
    if loose:
        yield f"a joint that fixes '{loose}' to the world"
    if survey.added:
        interfaces = dict.fromkeys(each.interface for each in survey.motors)
        yield f"transmissions ({', '.join(interfaces)})"
    if not survey.has_plugin:
        yield "ros_control's plugin"


def _report(
    request: PackageRequest,
    copied: Copied,
    survey: Survey,
    base: Base | None,
    more: str,
    stands: float | None,
    note: str,
) -> Iterator[str]:
    yield f"written: {request.folder}"
    joints = ", ".join(each.joint for each in survey.motors)
    if more:
        yield f"what the file lacks: {more}"
    hint = " (--passive JOINT leaves one without)" if survey.added else ""
    yield f"joints with a motor and a controller: {joints}{hint}"
    wheels = [each.joint for each in survey.motors if each.wheel]
    if base:
        yield (
            f"{', '.join(base.left)} on the left and {', '.join(base.right)} on the right get a {DRIVE}: "
            f"wheels of {base.radius:g} m, {base.separation:g} m apart"
        )
        if base.note:
            yield f"note: the task uses no laser: {base.note}"
        elif base.laser:
            yield (
                f"the task uses its laser '{base.laser.name}': what is nearer than {base.touch:g} m is "
                "touched"
            )
    elif wheels:
        yield f"continuous joints of a free base get a velocity controller, as wheels: {', '.join(wheels)}"
        yield (
            "note: a diff_drive_controller takes velocity motors, as many on the left as on the right, "
            "alike, and with axes to the left"
        )
    if not survey.model.fixed_base:
        yield height_note(request.height or 0.0, stands)
        if note:
            yield note
    if survey.passive:
        yield f"joints that move without a motor, and that tasks don't see: {', '.join(survey.passive)}"
    if survey.followers:
        yield f"joints that follow another one by <mimic>: {', '.join(survey.followers)}"
    held = [each.joint for each in survey.motors if not each.limited]
    if held:
        yield (
            f"limits of effort and velocity that are 0 would hold {', '.join(held)}: config/controllers.yaml "
            "lifts them; the true ones belong into the URDF"
        )
    others = ", ".join(each for each in copied.packages if each not in OURS)
    if others:
        yield f"it takes files from other packages (--standalone copies them): {others}"
    for path in copied.outside:
        yield f"not copied, and read from where it is: {path}"
    warnings = survey.model.warnings
    for warning in warnings[:NOTES]:
        yield f"note: {warning}"
    if len(warnings) > NOTES:
        yield f"note: {len(warnings) - NOTES} more of such"
    yield f"in {TREE}, next:" if IS_CHECKOUT else "next:"
    near = request.folder.parent == PARENT
    here = os.path.relpath(request.folder, TREE) if near else str(request.folder)
    commands = _commands(request.name, base, shlex.quote(here), list(_others(copied)))
    yield from (f"  {each}" for each in commands)


def _commands(name: str, base: Base | None, here: str, others: Sequence[str]) -> list[str]:
    """Returns commands for the next steps, to run in the checkout; `here` and `others` are for ws."""
    ws = f"./ws {''.join(f'--with {each} ' for each in others)}--with {here}"
    run = f"{ws} rosrun cartpole workbench.py"
    runs, (algo, task) = f"runs/{name}", ("sac", "Drive") if base else ("ppo", "Reach")
    return [
        f"{ws} roslaunch {name} simulation.launch    # look at it; Ctrl-C ends it",
        f"{ws} test {here}",
        f"{ws} rostest {name} simulation.test",
        "./ws extras true    # once: Stable-Baselines3",
        f"{run} train --algo {algo} --env-id {name}.environment:{name}/{task}-v0 "
        f"--config {here}/config/{algo}.yaml --run-dir {runs}",
        f"{run} eval {runs} --episodes 20",
        f"{run} record {runs} --out {name}.gif",
        f"{run} eval {runs} --episodes 5 --env-kwargs backend=ros    # the same over ROS",
    ]


def _others(copied: Copied) -> Iterator[str]:
    """Yields folders passed to ws that hold packages which the robot needs."""
    needed = [path.resolve() for each in copied.packages if (path := _package(each)) is not None]
    for folder in filter(None, os.environ.get("CARTPOLE_WITH", "").split(":")):
        if any(path.is_relative_to(Path(folder).resolve()) for path in needed):
            yield shlex.quote(folder)
