"""The reader of SDF worlds, and of models and lights in spawn requests."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from robot_sim.physics.actor import Script
from robot_sim.physics.description import (
    DescriptionError,
    Inertia,
    Light,
    LimitExceeded,
    Link,
    ModelDescription,
    Plugin,
    Shape,
)
from robot_sim.physics.files import elements
from robot_sim.physics.files.element_table import without_effect
from robot_sim.physics.files.elements import named, numbers, read_plugin, shown, truth
from robot_sim.physics.files.own_models import own_models
from robot_sim.physics.files.population import clones
from robot_sim.physics.files.reading import LoadProgress, MeshFinder, Reading, Resources
from robot_sim.physics.files.saved_state import begin_as_saved, saved_time
from robot_sim.physics.files.sdf import (
    FileContext,
    add_frames,
    first_entity,
    open_include,
    read_model,
    renamed,
    sdf_version,
)
from robot_sim.physics.files.sdf_parts import WORLD, Frames, read_color, read_pose, value
from robot_sim.physics.files.sdf_shapes import ShapeReader
from robot_sim.physics.files.urdf import read_urdf
from robot_sim.physics.pose import Pose, Vector
from robot_sim.physics.world import GRAVITY, TIME_STEP, SolverSettings, World, ground_plane

UPDATE_RATE = 1000.0  # [Hz], SDF's default
SOLVER = {
    "precon_iterations": "solver/precon_iters",
    "iterations": "solver/iters",
    "sor": "solver/sor",
    "cfm": "constraints/cfm",
    "erp": "constraints/erp",
    "contact_max_correcting_vel": "constraints/contact_max_correcting_vel",
    "contact_surface_layer": "constraints/contact_surface_layer",
}
"""Elements of `<physics><ode>`."""
STOPGAP = 0.3  # [m]; sides of the box in place of an actor that can't be seen


@dataclass
class WorldDescription:
    """The contents of a world file. `plugins` are the world's own."""

    name: str = "default"
    models: dict[str, ModelDescription] = field(default_factory=dict)
    lights: dict[str, Light] = field(default_factory=dict)
    gravity: Vector = GRAVITY
    start: int = 0  # [ns], of simulated time
    time_step: float = TIME_STEP  # [s]
    update_rate: float = UPDATE_RATE  # [Hz of wall time]; 0 means as fast as possible
    solver: SolverSettings = SolverSettings()
    warnings: list[str] = field(default_factory=list)
    plugins: list[Plugin] = field(default_factory=list)


def empty_world() -> WorldDescription:
    """Returns a world with a ground plane and a sun."""
    sun = read_light(own_models()["sun"])
    return WorldDescription(models={"ground_plane": ground_plane()}, lights={"sun": sun})


def load_world(path: Path, resources: Resources, reading: Reading | None = None) -> WorldDescription:
    """Reads a world file. A model that can't be read is left out, with a warning.

    Raises:
        DescriptionError: In one line, if the file as a whole can't be used.
    """
    reading = reading or Reading()
    root = reading.open(path)
    with elements.place(str(path)):
        return _read(root, FileContext(resources, reading, sdf_version(root), path.parent))


def parse_world(text: str | bytes, resources: Resources) -> WorldDescription:
    """Reads the text of a world file like `load_world`."""
    reading = Reading()
    root = reading.parse(text)
    return _read(root, FileContext(resources, reading, sdf_version(root)))


def _read(root: Element, context: FileContext) -> WorldDescription:
    """Reads a world file from its root element."""
    element = root.find("world")
    if element is None:
        raise DescriptionError("there is no <world>")
    world = WorldDescription(element.get("name", "") or "default")
    world.warnings += without_effect(root, "sdf")
    _read_physics(world, element)
    frames = Frames()
    frames.add(WORLD, Pose(), "")
    context = replace(context, frames=frames)
    progress = LoadProgress("entities of the world file are read", len(element))
    for child in element:
        progress.one_more()
        if child.tag in ("model", "include", "light"):
            context.reading.begin()
            _add(world, child, context)
        elif child.tag == "plugin":
            world.plugins.append(read_plugin(child))
    for child in element.findall("actor"):  # Gazebo lists them after the models
        context.reading.begin()
        _add(world, child, context)
    for child in element.iterfind("state[1]/insertions/*"):
        _add(world, child, context)
    _place(world, element, frames)
    state = element.find("state")  # the first one
    if state is not None:
        world.start = saved_time(state, world.warnings)
        world.warnings += begin_as_saved(state, world.models, world.lights)
        for name in [(each.text or "").strip() for each in state.iterfind("deletions/name")]:
            world.models.pop(name, None)
            world.lights.pop(name, None)
    for child in element.findall("population"):  # once all else is there
        _add(world, child, context)
    return world


def read_light(element: Element) -> Light:
    """Returns the light of a `<light>` element."""
    name = named(element, "light")
    where = f"light '{shown(name)}'"
    pose, _ = read_pose(element, where)
    light = Light(name, pose=pose, kind=element.get("type", "point"))
    for key in ("diffuse", "specular"):
        text = element.findtext(key)
        if text is not None:
            setattr(light, key, read_color(text, f"{where}: <{key}>"))
    for key in ("constant", "linear", "quadratic"):
        attribute = f"attenuation_{key}"
        default = getattr(light, attribute)
        setattr(light, attribute, value(element, f"attenuation/{key}", where, default))
    direction = element.findtext("direction")
    if direction is not None:
        x, y, z = numbers(direction, f"{where}: <direction>", 3)
        light.direction = (x, y, z)
    light.cast_shadows = truth(element.findtext("cast_shadows"))
    return light


def _read_actor(element: Element, context: FileContext) -> ModelDescription:
    """Returns an `<actor>` as a model that nothing moves or touches.

    Its link, named as the first one of a skeleton in Gazebo, has the skin and all links' visuals.
    """
    name = named(element, "actor")
    with elements.place(f"actor '{shown(name)}'"):
        link = Link(f"{name}_pose", Inertia(1.0, ixx=1.0, iyy=1.0, izz=1.0))
        model = ModelDescription(name, {link.name: link}, {}, link.name, world_joints=[WORLD])
        model.initial_pose, _ = read_pose(element, "actor")
        meshes = MeshFinder(context.resources, context.reading, context.folder, model.warnings)
        for each in element.findall("skin"):
            size = elements.positive((value(each, "scale", "skin", 1.0),) * 3, "skin")
            mesh = meshes.find(each.findtext("filename") or "", "skin", needed=False)
            link.visuals += [Shape("mesh", size, mesh=mesh[0])] if mesh else []
        for each in element.findall("link"):
            where = f"link '{shown(each.get('name', ''))}'"
            pose, _ = read_pose(each, where)
            shapes = ShapeReader(meshes, Frames()).read(each, "visual", where)
            link.visuals += [replace(shape, pose=pose.compose(shape.pose)) for shape in shapes]
        if not link.visuals:
            link.visuals = [Shape("box", (STOPGAP,) * 3)]
            why = "; ".join(model.warnings) or "it has no skin"
            model.warnings[:] = [f"{why}; a box of {STOPGAP} m stands in for it"]
        try:
            model.script = _script(element, model.warnings)
        except DescriptionError as error:
            model.warnings.append(f"{error}; it stays at its pose")
        return model


def _script(actor: Element, warnings: list[str]) -> Script | None:
    """Returns the script; None if it has no trajectory, or doesn't start."""
    script = actor.find("script")
    if script is None or not truth(script.findtext("auto_start"), default=True):
        return None
    delay = value(script, "delay_start", "script", 0.0)
    points: list[tuple[float, Pose]] = []
    for number, trajectory in enumerate(script.findall("trajectory")):
        where = f"script, trajectory {number}"
        given = [
            (value(each, "time", where, 0.0), read_pose(each, f"{where}, waypoint")[0])
            for each in trajectory.findall("waypoint")
        ]
        times = [time for time, _ in given]
        if not times or min(delay, *times) < 0.0:
            raise DescriptionError(f"{where}: it has no waypoint, or a negative time")
        if times != sorted(set(times)):
            warnings.append(f"{where}: its waypoints are taken in the order of their times")
        (_, first), *others = sorted(dict(given).items())
        # As in Gazebo, each trajectory begins at its first waypoint, whenever that is, as the last one ends.
        start = points[-1][0] if points else 0.0
        points += [(start, first), *((start + time, pose) for time, pose in others)]
    loop = truth(script.findtext("loop"), default=True)
    return Script(tuple(points), delay, loop) if points else None


def _add(world: WorldDescription, element: Element, context: FileContext) -> None:
    """Adds one model, light or actor, or a population. If it is broken, it alone is left out."""
    try:
        if element.tag == "population":
            with elements.place(f"population '{shown(element.get('name', ''))}'"):
                for clone in clones(element):
                    context.reading.begin()
                    _keep(world, clone, context)
        elif element.tag == "include":
            _keep(world, *open_include(element, context))
        else:
            _keep(world, element, context)
    except LimitExceeded:
        raise
    except DescriptionError as error:
        world.warnings.append(f"{error}; it is left out")


def _keep(world: WorldDescription, element: Element, context: FileContext) -> None:
    entity = _entity(element, context)
    kept: dict[str, Any] = world.lights if isinstance(entity, Light) else world.models
    if entity.name in kept:
        raise DescriptionError(f"'{shown(entity.name)}' is there twice")
    kept[entity.name] = entity
    if context.frames is not None and kept is world.models:
        context.frames.add(entity.name, *read_pose(element, "model"))


def _place(world: WorldDescription, element: Element, frames: Frames) -> None:
    """Places models whose `<pose>` is relative to another one, or to a `<frame>` of the world."""
    try:
        add_frames(element, frames)
    except DescriptionError as error:
        world.warnings.append(f"{error}; frames from there on are left out")
    for name, model in world.models.items():
        try:
            model.initial_pose = frames.resolve(name)
        except DescriptionError as error:
            model.warnings.append(f"<pose>: {error}; it is the world's")


def _read_physics(world: WorldDescription, element: Element) -> None:
    """Reads gravity and the physics profile: the default one, if there are several."""
    profiles = element.findall("physics")
    profile = next((p for p in profiles if truth(p.get("default"))), profiles[0] if profiles else None)
    gravity = element.findtext("gravity")
    if gravity is None and profile is not None:
        gravity = profile.findtext("gravity")  # SDF 1.4
    if gravity is not None:
        x, y, z = numbers(gravity, "<gravity>", 3)
        world.gravity = (x, y, z)
    world.time_step = value(profile, "max_step_size", "<physics>", TIME_STEP)
    world.update_rate = value(profile, "real_time_update_rate", "<physics>", UPDATE_RATE)
    world.solver = _read_solver(profile)
    if not 0.0 < world.time_step <= 1.0:
        raise DescriptionError(f"<max_step_size>: {world.time_step} is not between 0 and 1 s")
    if world.update_rate < 0.0:
        raise DescriptionError(f"<real_time_update_rate>: {world.update_rate} is negative")


def _read_solver(profile: Element | None) -> SolverSettings:
    read: dict[str, Any] = {}
    for name, path in SOLVER.items():
        default = getattr(SolverSettings, name)
        number = value(profile, f"ode/{path}", "<physics>", default)
        if number < 0.0:
            raise DescriptionError(f"<physics>: {number} in <{path.split('/')[-1]}> is negative")
        read[name] = type(default)(number)
    return SolverSettings(**read)


def fill(
    world: World, models: Mapping[str, ModelDescription]
) -> Iterator[tuple[str, DescriptionError | None]]:
    """Adds a file's models to an empty world; yields the name of each, and why the engine can't take it."""
    places = [each.initial_pose.compose(each.root_pose) for each in models.values()]
    bodies = world.engine.load_all(list(zip(models.values(), places, strict=True)))
    for (name, description), body in zip(models.items(), bodies, strict=True):
        if isinstance(body, DescriptionError):
            yield name, body
        else:
            world.admit(name, description, body, description.initial_pose)
            yield name, None


class UnknownFormat(DescriptionError):
    """The text is neither SDF nor URDF."""


def read_entity(text: str, name: str, resources: Resources, reading: Reading) -> ModelDescription | Light:
    """Returns the first model or light of `text`, under the given name.

    Raises:
        UnknownFormat: If it is neither.
        DescriptionError: If it can't be simulated: the place and the fault, in one line.
        LimitExceeded: If it exceeds the limits of one model (docs/gazebo.md).
    """
    try:
        root = reading.parse(text)
    except LimitExceeded as error:
        raise LimitExceeded(f"model '{shown(name)}': {error}") from error
    except DescriptionError as error:
        raise UnknownFormat(str(error)) from error
    if root.tag not in ("robot", "sdf", "gazebo"):
        raise UnknownFormat(f"the root element is <{shown(root.tag)}>")
    if root.tag == "robot":
        with elements.place(f"model '{shown(name)}'"):
            return read_urdf(root, resources, reading)
    element, context = first_entity(root), FileContext(resources, reading, sdf_version(root))
    if element.tag == "include":
        element, context = open_include(element, context)
    return _entity(renamed(element, name), context)


def _entity(element: Element, context: FileContext) -> ModelDescription | Light:
    if element.tag == "light":
        return read_light(element)
    return (_read_actor if element.tag == "actor" else read_model)(element, context)
