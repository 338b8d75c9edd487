"""The page of `check_robot.py` on a file: what is read and served, whether it stands, and what moves."""

import importlib.util
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np

from package_writing.check_files import CannotUse, RobotFile
from package_writing.check_motion import SECONDS, Trial, observe
from package_writing.trial import ENGINES
from robot_envs import Robot, RobotEnvError, controllers, files
from robot_sim.control.errors import ControlError
from robot_sim.physics.description import (
    DescriptionError,
    ModelDescription,
    Plugin,
    is_control_plugin,
    library_of,
)
from robot_sim.physics.engines import installing
from robot_sim.physics.files.elements import truth
from robot_sim.physics.files.sdf_parts import MOMENTS
from robot_sim.physics.files.world_file import WorldDescription

SHOWN = 8  # lines and names of one kind


@dataclass
class Findings:
    """What is known of a file: lines by their headings, notes, and what is wrong with the robot."""

    file: str
    lines: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        rows = list(self.lines.items())
        for heading, found in (("note", self.notes), ("WRONG", self.wrong)):
            rows += [(heading, each) for each in found[:SHOWN]]
            rows += [(heading, f"{len(found) - SHOWN} more")] if len(found) > SHOWN else []
        rows.append(("verdict", f"faults: {len(self.wrong)}" if self.wrong else "fine"))
        return "\n".join([self.file, *(f"  {heading:<12}{each}" for heading, each in rows)])


def examine(file: RobotFile, parameters: str | None) -> Findings:
    """Examines a file; `parameters` is a YAML file of its controllers.

    Raises:
        CannotUse: if that file can't be read.
    """
    page, content = Findings(str(file.path)), file.content
    interfaces: Mapping[str, str] = {}
    if isinstance(content, ModelDescription):
        page.notes += [f"without effect: {each}" for each in content.left_out]
        page.notes += content.warnings
        page.lines |= _contents(content)
        known = {*content.links, *content.lumped, "world"}
        lost = [each.get("name", "") for each in file.root.findall("link")]
        page.wrong += [f"link '{name}' is dropped: no mass" for name in lost if name not in known]
        page.wrong += [] if content.static else _inertia_faults(file.root)
        _add_served(page, [content], [])
        if file.root.tag == "robot":
            interfaces = _control(page, file, content, parameters)
    else:
        page.wrong += [*content.warnings, *_inertia_faults(file.root)]  # models that are left out
        models = list(content.models.values())
        page.notes += [f"model '{m.name}': {w}" for m in models for w in (*m.warnings, *m.left_out)]
        page.lines["world"] = f"{content.name}; models: {', '.join(content.models) or 'none'}"
        _add_served(page, models, content.plugins)
    faults = defaultdict(list)
    for module, engine in ENGINES.items():
        name = {"bullet": "PyBullet", "mujoco": "MuJoCo"}[engine]
        if importlib.util.find_spec(module) is None:
            page.notes.append(f"not tried with {name}: '{installing(module)}' installs it")
            continue
        try:
            motion = observe(content, interfaces, engine)
        except DescriptionError as error:
            motion = Trial(str(error))
        page.lines[name] = _behaviour(content, motion)
        for text in (motion.fault, *motion.still) if motion.fault else motion.still:
            faults[text].append(name)
    page.wrong += [f"{text} ({' and '.join(names)})" for text, names in faults.items()]
    return page


def _behaviour(content: ModelDescription | WorldDescription, motion: Trial) -> str:
    if not isinstance(content, ModelDescription) or content.static:
        return motion.fault or f"nothing blows up within {SECONDS:g} s"
    found = motion.fault or ("held by its fixed base" if content.fixed_base else "stands")
    if not content.fixed_base:
        found += f", {1000.0 * motion.sank:.1f} mm lower and tilted by {motion.tilt:.1f}° after "
        found += f"{SECONDS:g} s, joints held"
    joints = len(motion.still) + motion.moved
    return found + (f"; commands move {motion.moved} of {joints} joints" if joints else "")


def _contents(model: ModelDescription) -> Iterator[tuple[str, str]]:
    kinds = Counter(each.kind for each in model.joints.values())
    base = "static" if model.static else "fixed to the world" if model.fixed_base else "free"
    yield "model", f"{model.name}: base {base}"
    lumped = f", {len(model.lumped)} more lumped into them" if model.lumped else ""
    solid = sum(bool(each.collisions) for each in model.links.values())
    yield "links", f"{len(model.links)}, {solid} with collisions{lumped}"
    far = [sum(math.hypot(*j.pose.position) for j in model.carriers(n)) for n in model.links]
    if kinds:
        listed = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        yield "joints", f"{listed}; reach {max(far):.3g} m to the last one, stretched out"
    masses = sorted((each.inertia.mass, name) for name, each in model.links.items() if each.inertia)
    if masses:
        total = math.fsum(mass for mass, _ in masses)
        (light, lightest), (heavy, heaviest) = masses[0], masses[-1]
        ends = f", from {light:.3g} kg ({lightest}) to {heavy:.3g} kg ({heaviest})"
        yield "mass", f"{total:.4g} kg{ends if len(masses) > 1 else ''}"


def _inertia_faults(root: Element) -> Iterator[str]:
    """Yields links whose moments of inertia no body has."""
    moving = [each for each in root.iter("model") if not truth(each.findtext("static"))]
    models, unsaid = (
        ([root], dict.fromkeys(MOMENTS, 0.0)) if root.tag == "robot" else (moving, MOMENTS)
    )
    for link in (link for model in models for link in model.findall("link")):
        tensor = link.find("inertial/inertia")
        if tensor is None:
            continue
        given = [tensor.get(key) or tensor.findtext(key) or value for key, value in unsaid.items()]
        try:
            xx, xy, xz, yy, yz, zz = map(float, given)
        except ValueError:
            continue  # a warning says so
        low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments = f"{low:.3g}, {middle:.3g}, {high:.3g} kg m²"
        if not low > 0.0:
            yield f"link '{link.get('name')}': moments of inertia must be above 0: {moments}"
        elif low + middle < 0.999 * high:
            yield f"link '{link.get('name')}': one moment of inertia exceeds the sum of the others: {moments}"


def _add_served(
    page: Findings, models: Sequence[ModelDescription], plugins: Sequence[Plugin]
) -> None:
    known = None
    if importlib.util.find_spec("rospy") is not None:  # which plugins import
        from bullet_gazebo.plugins.plugin_loader import built_in

        known = {*built_in("LIBRARIES"), *built_in("WORLD_LIBRARIES")}

    def said(plugins: Iterable[Plugin]) -> list[str]:
        names = [library_of(each.filename) for each in plugins]
        page.notes += [f"nothing serves {each}" for each in names if known and each not in known]
        return names

    sensors = [each for model in models for each in model.sensors]
    listed = [f"{s.name}: {s.kind}, {', '.join(said(s.plugins)) or 'no plugin'}" for s in sensors]
    libraries = said([*plugins, *(each for model in models for each in model.plugins)])
    page.lines |= {h: "; ".join(f) for h, f in (("plugins", libraries), ("sensors", listed)) if f}


def _control(
    page: Findings, file: RobotFile, model: ModelDescription, parameters: str | None
) -> Mapping[str, str]:
    """Adds transmissions and controllers; returns hardware interfaces by joint."""
    plugin = next((each for each in model.plugins if is_control_plugin(each.filename)), None)
    namespace = "" if plugin is None else (plugin.element.findtext("robotNamespace") or "").strip()
    try:
        tree = {} if parameters is None else files.read_parameters(parameters)
    except RobotEnvError as error:
        raise CannotUse(str(error)) from error
    robot = Robot(urdf=file.text, controllers=tree, namespace=namespace)
    movable = [each.name for each in model.movable_joints]
    try:
        interfaces = {each.joint: each.interface for each in robot.control.transmissions}
        hardware = robot.hardware()
    except (ControlError, RobotEnvError) as error:
        page.wrong.append(str(error))
        return {}
    page.notes += robot.control.warnings
    page.wrong += [
        f"transmission of '{name}': it is no joint that moves"
        for name in set(interfaces) - set(movable)
    ]
    passive = [name for name in movable if name not in interfaces and name not in model.mimics]
    counts = [f"{count} {kind}" for kind, count in Counter(interfaces.values()).items()]
    page.lines["control"] = ", ".join(counts) or "no transmissions, so no controller moves it"
    page.lines["control"] += f"; passive: {', '.join(passive)}" if counts and passive else ""
    if counts and plugin is None:
        page.notes.append("it has transmissions, but no plugin libgazebo_ros_control.so")
    tree = dict(robot.parameters)
    typed = [name for name, each in tree.items() if isinstance(each, Mapping) and "type" in each]
    faults = {
        name: list(controllers.faults([name], None, tree, hardware, movable)) for name in typed
    }
    good = [f"{name} ({tree[name]['type']})" for name, found in faults.items() if not found]
    page.wrong += [each for found in faults.values() for each in found]
    if parameters is not None:
        page.lines["controllers"] = f"{len(good)} of {len(typed)} served: {', '.join(good)}"
        if not typed:
            where = f"in the namespace {namespace}" if namespace else "outside of namespaces"
            page.wrong.append(f"{parameters} has no controller {where}, where the URDF has them")
    return interfaces
