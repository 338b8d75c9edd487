"""The page of `check_robot.py` on a file: contents, topics and services, standing and motion."""

import importlib.util
import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from package_writing.check_motion import observe
from package_writing.trial import ENGINES
from robot_envs import Robot, RobotEnvError, controllers
from robot_sim.control.errors import ControlError
from robot_sim.physics.description import ModelDescription, Plugin, is_control_plugin, library_of
from robot_sim.physics.engines import installing
from robot_sim.physics.files.elements import truth
from robot_sim.physics.files.sdf_parts import MOMENTS
from robot_sim.physics.files.world_file import WorldDescription

SHOWN = 8  # lines and names of one kind
NAMES = {"bullet": "PyBullet", "mujoco": "MuJoCo"}


class RobotFile(NamedTuple):
    """A file and its contents: a model, or a world."""

    path: Path
    text: str
    root: Element
    content: ModelDescription | WorldDescription


@dataclass
class Findings:
    """The results for a file: lines by their headings, notes, and faults of the robot."""

    file: str
    lines: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        rows = list(self.lines.items())
        for heading, texts in (("note", self.notes), ("WRONG", self.wrong)):
            more = [f"{len(texts) - SHOWN} more"] if len(texts) > SHOWN else []
            rows += [(heading, each) for each in [*texts[:SHOWN], *more]]
        rows.append(("verdict", f"faults: {len(self.wrong)}" if self.wrong else "fine"))
        return "\n".join([self.file, *(f"  {heading:<12}{each}" for heading, each in rows)])


def examine(file: RobotFile, parameters: str | None) -> Findings:
    """Examines a file; `parameters` is a YAML file of its controllers."""
    page, content = Findings(str(file.path)), file.content
    interfaces: Mapping[str, str] = {}
    if isinstance(content, ModelDescription):
        models, plugins = [content], []
        page.notes += [f"without effect: {each}" for each in content.left_out]
        page.notes += content.warnings
        page.lines |= _contents(content)
        known = {*content.links, *content.lumped, "world"}
        lost = [each.get("name", "") for each in file.root.findall("link")]
        page.wrong += [f"link '{name}' is dropped: no mass" for name in lost if name not in known]
        page.wrong += [] if content.static else _inertia_faults(file.root)
    else:
        page.wrong += [*content.warnings, *_inertia_faults(file.root)]  # models that are left out
        models, plugins = list(content.models.values()), content.plugins
        page.notes += [f"model '{m.name}': {w}" for m in models for w in (*m.warnings, *m.left_out)]
        page.lines["world"] = f"{content.name}; models: {', '.join(content.models) or 'none'}"
    _add_served(page, models, plugins)
    if isinstance(content, ModelDescription) and file.root.tag == "robot":
        interfaces = _control(page, file.text, content, parameters)
    faults = defaultdict(list)
    for module, engine in ENGINES.items():
        name = NAMES[engine]
        if importlib.util.find_spec(module) is None:
            page.notes.append(f"not tried with {name}: '{installing(module)}' installs it")
            continue
        page.lines[name], texts = observe(content, interfaces, engine)
        for text in texts:
            faults[text].append(name)
    page.wrong += [f"{text} ({' and '.join(names)})" for text, names in faults.items()]
    return page


def _contents(model: ModelDescription) -> Iterator[tuple[str, str]]:
    base = "static" if model.static else "fixed to the world" if model.fixed_base else "free"
    yield "model", f"{model.name}: base {base}"
    lumped = f", {len(model.lumped)} more lumped into them" if model.lumped else ""
    solid = sum(bool(each.collisions) for each in model.links.values())
    yield "links", f"{len(model.links)}, {solid} with collisions{lumped}"
    if kinds := Counter(each.kind for each in model.joints.values()):
        far = (sum(math.hypot(*j.pose.position) for j in model.carriers(n)) for n in model.links)
        listed = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        yield "joints", f"{listed}; reach {max(far):.3g} m to the last one, stretched out"
    masses = sorted((each.inertia.mass, name) for name, each in model.links.items() if each.inertia)
    if masses:
        (light, lightest), (heavy, heaviest) = masses[0], masses[-1]
        ends = f", from {light:.3g} kg ({lightest}) to {heavy:.3g} kg ({heaviest})"
        total = math.fsum(mass for mass, _ in masses)
        yield "mass", f"{total:.4g} kg{ends if len(masses) > 1 else ''}"


def _inertia_faults(root: Element) -> Iterator[str]:
    """Yields links whose moments of inertia no body has."""
    moving = [each for each in root.iter("model") if not truth(each.findtext("static"))]
    is_urdf = root.tag == "robot"
    defaults = dict.fromkeys(MOMENTS, 0.0) if is_urdf else MOMENTS
    for link in (link for each in ([root] if is_urdf else moving) for link in each.findall("link")):
        tensor = link.find("inertial/inertia")
        if tensor is None:
            continue
        given = [tensor.get(key) or tensor.findtext(key) or mean for key, mean in defaults.items()]
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


def _add_served(page: Findings, models: list[ModelDescription], world: list[Plugin]) -> None:
    """Adds plugins and sensors, and notes on those that nothing serves."""
    plugins = [*world, *(each for model in models for each in model.plugins)]
    libraries, served, sensors = [library_of(each.filename) for each in plugins], [], []
    for sensor in (each for model in models for each in model.sensors):
        own = [library_of(each.filename) for each in sensor.plugins]
        sensors.append(f"{sensor.name}: {sensor.kind}, {', '.join(own) or 'no plugin'}")
        served += own
    if importlib.util.find_spec("rospy") is not None:  # which plugins import
        from bullet_gazebo.plugins.plugin_loader import built_in

        known = {*built_in("LIBRARIES"), *built_in("WORLD_LIBRARIES")}
        unknown = [each for each in (*served, *libraries) if each not in known]
        page.notes += [f"nothing serves {each}" for each in unknown]
    page.lines |= {h: "; ".join(f) for h, f in (("plugins", libraries), ("sensors", sensors)) if f}


def _control(page: Findings, text: str, model: ModelDescription, parameters: str | None) -> Mapping[str, str]:
    """Adds transmissions and controllers; returns hardware interfaces by joint."""
    plugin = next((each for each in model.plugins if is_control_plugin(each.filename)), None)
    namespace = "" if plugin is None else (plugin.element.findtext("robotNamespace") or "").strip()
    robot = Robot(urdf=text, controllers=parameters or {}, namespace=namespace)
    movable = [each.name for each in model.movable_joints]
    try:
        interfaces = {each.joint: each.interface for each in robot.control.transmissions}
        hardware = robot.hardware()
    except (ControlError, RobotEnvError) as error:
        page.wrong.append(str(error))
        return {}
    page.notes += robot.control.warnings
    unknown = set(interfaces) - set(movable)
    page.wrong += [f"transmission of '{name}': it is no joint that moves" for name in unknown]
    passive = [name for name in movable if name not in interfaces and name not in model.mimics]
    counts = [f"{count} {kind}" for kind, count in Counter(interfaces.values()).items()]
    page.lines["control"] = ", ".join(counts) or "no transmissions, so no controller moves it"
    page.lines["control"] += f"; passive: {', '.join(passive)}" if counts and passive else ""
    if counts and plugin is None:
        page.notes.append("it has transmissions, but no plugin libgazebo_ros_control.so")
    if parameters is None:
        return interfaces
    tree = robot.parameters
    typed = [name for name, each in tree.items() if isinstance(each, Mapping) and "type" in each]
    good = []
    for name in typed:
        faults = list(controllers.faults([name], None, tree, hardware, movable))
        page.wrong += faults
        good += [] if faults else [f"{name} ({tree[name]['type']})"]
    page.lines["controllers"] = f"{len(good)} of {len(typed)} served: {', '.join(good)}"
    if not typed:
        where = f"in the namespace {namespace}" if namespace else "outside of namespaces"
        page.wrong.append(f"{parameters} has no controller {where}, where the URDF has them")
    return interfaces
