"""The reader of SDF models, versions 1.4 to 1.7 (sdformat.org).

Links keep their frames; joints become parent-relative. Nested and included models become part of the outer
one, with links and joints named `nested::name`. Links of a static model need no joints.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree.ElementTree import Element

from robot_sim.physics.description import (
    DescriptionError,
    Joint,
    LimitExceeded,
    Link,
    ModelDescription,
    Plugin,
    Sensor,
)
from robot_sim.physics.files.element_table import MODEL, WithoutEffect
from robot_sim.physics.files.elements import files_named_by_a_model, named, place, read_plugin, shown, truth
from robot_sim.physics.files.mechanisms import add_mechanisms
from robot_sim.physics.files.motion import read_link_motion, settle_kinematic
from robot_sim.physics.files.own_models import own_models
from robot_sim.physics.files.reading import MeshFinder, Reading, Resources
from robot_sim.physics.files.sdf_parts import (
    WORLD,
    Frames,
    JointReader,
    joint_end,
    read_inertia,
    read_pose,
    read_sensors,
)
from robot_sim.physics.files.sdf_shapes import ShapeReader
from robot_sim.physics.loops import span
from robot_sim.physics.lumping import detach_from_world, mend_moments, unique
from robot_sim.physics.pose import Pose

OVERRIDES = ("pose", "static")
MODEL_URI = "model://"
MAX_NESTING = 10
VERSION = re.compile(r"(\d{1,9})\.(\d{1,9})(\.\d+)?", re.ASCII)
NEWEST = (1, 7)


@dataclass(frozen=True)
class FileContext:
    """The file of an element: how its URIs are resolved, and its version of SDF.

    `unread` collects what has no effect in the model that is read, `frames` the places of a world's models.
    """

    resources: Resources
    reading: Reading
    version: tuple[int, int]
    folder: Path | None = None
    unread: WithoutEffect = field(default_factory=WithoutEffect)
    frames: Frames | None = None


def open_include(include: Element, context: FileContext) -> tuple[Element, FileContext]:
    """Returns what `include` names, a model, light or actor, with its name, pose and static flag."""
    uri = (include.findtext("uri") or "").strip()
    with place(f"<include> of '{shown(uri)}'"):
        if not uri:
            raise DescriptionError("<uri> is missing")
        entity, inner = _open(uri, context)
        return _overridden(entity, include), inner


def _open(uri: str, context: FileContext) -> tuple[Element, FileContext]:
    """Opens a file of the user's; in place of one that can't be read, our own model of that name."""
    try:
        return _open_file(uri, context)
    except LimitExceeded:
        raise
    except DescriptionError:
        name = uri.removeprefix(MODEL_URI).strip("/") if uri.startswith(MODEL_URI) else ""
        if name not in own_models():
            raise
        return own_models()[name], replace(context, version=(1, 6), folder=None)


def _open_file(uri: str, context: FileContext) -> tuple[Element, FileContext]:
    with files_named_by_a_model(f"'{shown(uri)}'"):
        target = context.resources.find(uri, context.folder)
        path = _model_file(target, context.reading) if target.is_dir() else target
    root = context.reading.open(path)
    with place(str(path)):
        if root.tag not in ("sdf", "gazebo"):
            raise DescriptionError(f"the root element is <{shown(root.tag)}>, not <sdf>")
        for element in root:
            if element.tag in ("model", "light", "actor"):
                version = _version(root.get("version", "1.4")) or (1, 4)
                return element, replace(context, version=version, folder=path.parent)
        raise DescriptionError("there is no <model>")


def _overridden(entity: Element, include: Element) -> Element:
    """Returns a copy of the model's top element. Its children are shared: no one changes them."""
    given = [child for child in include if child.tag in OVERRIDES]
    tags = {child.tag for child in given}
    copy = Element(entity.tag, entity.attrib)
    name = (include.findtext("name") or "").strip()
    if name:
        copy.set("name", name)
    copy.extend(child for child in entity if child.tag not in tags)
    copy.extend(given)
    copy.extend(include.findall("plugin"))
    return copy


def _model_file(folder: Path, reading: Reading) -> Path:
    """Returns the newest file of model.config whose version is supported; without one, model.sdf."""
    config = folder / "model.config"
    if not config.is_file():
        return folder / "model.sdf"
    root = reading.open(config)
    with place(str(config)):
        files = [
            (_version(element.get("version", "")) or (1, 0), (element.text or "").strip())
            for element in root.findall("sdf")
        ]
        if not files:
            raise DescriptionError("it names no <sdf> file")
        readable = [file for file in files if file[0] <= NEWEST] or files
        return folder / max(readable)[1]


def _version(text: str) -> tuple[int, int] | None:
    match = VERSION.fullmatch(text.strip())
    return None if match is None else (int(match.group(1)), int(match.group(2)))


def renamed(entity: Element, name: str) -> Element:
    """Returns `entity` under another name."""
    copy = Element(entity.tag, {**entity.attrib, "name": name})
    copy.extend(entity)
    return copy


@dataclass
class _Parts:
    """The contents of a model and its nested models, in the outer model's frame."""

    links: list[Link] = field(default_factory=list)
    poses: dict[str, Pose] = field(default_factory=dict)
    nested: dict[str, Pose] = field(default_factory=dict)
    joints: list[Joint] = field(default_factory=list)
    plugins: list[Plugin] = field(default_factory=list)
    sensors: list[Sensor] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    stand_ins: list[str] = field(default_factory=list)


def parse_sdf(text: str | bytes, source: str = "SDF", resources: Resources | None = None) -> ModelDescription:
    """Returns the first model of an SDF text, in the file's pose if it gives one (`initial_pose`).

    Raises:
        DescriptionError: If it can't be simulated: `source`, the place and the fault, in one line.
    """
    with place(source):
        reading = Reading()
        root = reading.parse(text)
        context = FileContext(resources or Resources(), reading, sdf_version(root))
        model = first_entity(root)
        if model.tag == "include":
            model, context = open_include(model, context)
        return read_model(model, context)


def sdf_version(root: Element) -> tuple[int, int]:
    """Returns the version of an `<sdf>` or `<gazebo>` root."""
    if root.tag not in ("sdf", "gazebo"):
        raise DescriptionError(f"the root element is <{shown(root.tag)}>, not <sdf>")
    version = _version(root.get("version", "1.4"))
    if version is None or version[0] != 1:
        raise DescriptionError(f"<sdf version>: '{shown(root.get('version', ''))}' isn't a version 1.x")
    return version


def first_entity(root: Element) -> Element:
    """Returns the first model, `<include>` or light under the root, or else in its world."""
    if len(root) and root[0].tag == "light":
        return root[0]
    for parent in (root, *root.findall("world")):
        for element in parent:
            if element.tag in ("model", "include"):
                return element
    raise DescriptionError("there is no <model>")


def read_model(element: Element, context: FileContext) -> ModelDescription:
    """Returns the model of a `<model>` element."""
    name = named(element, "model")
    with place(f"model '{shown(name)}'"):
        static = truth(element.findtext("static"))
        context = replace(context, unread=WithoutEffect())
        parts = _read_parts(element, context, static, MAX_NESTING)
        parts.warnings[:0] = context.unread.warnings()
        if context.version > NEWEST:
            parts.warnings.append("written for a newer SDF than 1.7: what is new in it is ignored")
        solids = [shape.solid for link in parts.links for shape in link.collisions]
        if not static and any(solid and solid.is_heightmap for solid in solids):
            static = True
            parts.warnings.append("it has a height map, so it is static, as in Gazebo")
        model = _assemble(name, parts, static)
        model.initial_pose, frame = read_pose(element, "model")
        if context.frames is None and frame not in ("", WORLD):
            model.warnings.append(f"<pose>: it is the world's, not relative to '{shown(frame)}'")
        context.reading.split_meshes(model)
        return model


def _assemble(name: str, parts: _Parts, static: bool) -> ModelDescription:
    poses = {WORLD: Pose(), **parts.poses}
    if static:
        parts.joints = [
            joint if joint.movable else replace(joint, kind="fixed")
            for joint in parts.joints
            if joint.parent != WORLD
        ]
    elif any(joint.parent == WORLD for joint in parts.joints):
        parts.links.insert(0, Link(WORLD))
    links, joints = unique(parts.links, "link"), unique(parts.joints, "joint")
    roots = span(links, joints, parts.warnings)
    if len(roots) > 1 and not static:
        raise DescriptionError(
            f"links {roots[:10]} are not joined to each other; make them models of their own, "
            "or the model static"
        )
    model = ModelDescription(name, links, joints, roots[0], poses[roots[0]])
    model.islands = {root: poses[root].relative_to(poses[roots[0]]) for root in roots[1:]}
    model.nested, model.plugins, model.warnings = parts.nested, parts.plugins, parts.warnings
    model.static, model.sensors, model.stand_ins = static, parts.sensors, parts.stand_ins
    detach_from_world(model)
    mend_moments(model)
    settle_kinematic(model)
    add_mechanisms(model)
    return model


def _read_parts(model: Element, context: FileContext, static: bool, depth: int) -> _Parts:
    """Reads the contents of a model, in which `depth` levels of models may still be nested."""
    if depth == 0:
        raise LimitExceeded(f"models are nested more than {MAX_NESTING} deep (MAX_NESTING)")
    context.reading.model()
    parts, frames = _Parts(), Frames()
    if model.get("folder") not in own_models():
        where = "" if depth == MAX_NESTING else f"model '{shown(model.get('name', ''))}'"
        context.unread.look(model, MODEL, where)
    elif not truth(model.get("exact")):
        parts.stand_ins.append(model.get("folder", ""))
    nested = list(_nested(model, context, static, depth))
    _name_frames(model, frames)
    for name, element, inner in nested:
        frames.add(name, *read_pose(element, f"model '{name}'"))
        for link, pose in inner.poses.items():
            frames.add(f"{name}::{link}", pose, name)
    collide = truth(model.findtext("self_collide"))
    for element in model.findall("link"):
        context.reading.check()
        read = _read_link(element, context, frames, parts, static)
        read.self_collide = truth(element.findtext("self_collide"), default=collide)
        parts.links.append(read)
    for name, _, inner in nested:
        parts.nested[name] = frame = frames.resolve(name)
        parts.nested |= {f"{name}::{each}": frame.compose(p) for each, p in inner.nested.items()}
        _take_over(parts, inner, name)
    parts.poses = {link.name: frames.resolve(link.name) for link in parts.links}
    joints = JointReader(frames, context.version, parts.warnings)
    for element in model.findall("joint"):
        joint = joints.read(element)
        parts.joints.append(joint)
        parts.sensors += read_sensors(element, joint.child, parts.warnings, joint=joint.name)
    parts.plugins += [read_plugin(element) for element in model.findall("plugin")]
    return parts


def _nested(
    model: Element, context: FileContext, static: bool, depth: int
) -> Iterator[tuple[str, Element, _Parts]]:
    for element in model:
        if element.tag not in ("model", "include"):
            continue
        inner, inner_context, origin = element, context, ""
        if element.tag == "include":
            inner, inner_context = open_include(element, context)
            if inner.tag != "model":  # no part of a body
                continue
            origin = f" (<include> of '{shown((element.findtext('uri') or '').strip())}')"
        name = named(inner, "model")
        with place(f"model '{shown(name)}'{origin}"):
            yield name, inner, _read_parts(inner, inner_context, static, depth - 1)


def _take_over(parts: _Parts, inner: _Parts, prefix: str) -> None:
    for link in inner.links:
        link.name = f"{prefix}::{link.name}"
    for joint in inner.joints:
        joint.name, joint.child = f"{prefix}::{joint.name}", f"{prefix}::{joint.child}"
        joint.parent = joint.parent if joint.parent == WORLD else f"{prefix}::{joint.parent}"
        # The nested model was read in its own frame, so its joints to the world would be misplaced.
        if joint.parent == WORLD:
            raise DescriptionError(f"joint '{joint.name}': a nested model can't be joined to the world")
    parts.links += inner.links
    parts.joints += inner.joints
    parts.plugins += [
        replace(each, scope=f"{prefix}::{each.scope}" if each.scope else prefix) for each in inner.plugins
    ]
    parts.sensors += [
        replace(each, link=f"{prefix}::{each.link}", joint=f"{prefix}::{each.joint}" if each.joint else "")
        for each in inner.sensors
    ]
    parts.warnings += inner.warnings
    parts.stand_ins += inner.stand_ins


def _name_frames(model: Element, frames: Frames) -> None:
    for element in model.findall("link"):
        name = named(element, "link")
        frames.add(name, *read_pose(element, f"link '{name}'"))
    for element in model.findall("joint"):
        name = named(element, "joint")
        pose, relative_to = read_pose(element, f"joint '{name}'")
        frames.add(name, pose, relative_to or joint_end(element, "child"))
    add_frames(model, frames)


def add_frames(parent: Element, frames: Frames) -> None:
    """Adds the `<frame>`s of a model or world to its frames."""
    for element in parent.findall("frame"):
        name = named(element, "frame")
        pose, relative_to = read_pose(element, f"frame '{name}'")
        frames.add(name, pose, relative_to or element.get("attached_to", ""))


def _read_link(element: Element, context: FileContext, frames: Frames, parts: _Parts, static: bool) -> Link:
    name = named(element, "link")
    where = f"link '{name}'"
    meshes = MeshFinder(context.resources, context.reading, context.folder, parts.warnings, parts.stand_ins)
    shapes = ShapeReader(meshes, frames)
    link = Link(name, read_inertia(element, where, static))
    link.collisions = list(shapes.read(element, "collision", where))
    link.visuals = list(shapes.read(element, "visual", where))
    if not static and any(shape.kind == "plane" for shape in link.collisions):
        raise DescriptionError(f"{where}: a plane can only be part of a static model")
    link.gravity = truth(element.findtext("gravity"), default=True)
    read_link_motion(link, element, parts.warnings)
    parts.sensors += read_sensors(element, name, parts.warnings, frames)
    return link
