"""Models of world files and of a task's objects, for a world in this process."""

import logging
from collections.abc import Sequence

from robot_envs.errors import RobotEnvError
from robot_envs.files import Source, is_text, locate, need_file, read_text, resources
from robot_envs.robot import EMPTY
from robot_envs.task import Object
from robot_sim.physics.description import DescriptionError, Light, ModelDescription
from robot_sim.physics.files.reading import Reading
from robot_sim.physics.files.world_file import (
    WorldDescription,
    empty_world,
    load_world,
    parse_world,
    read_entity,
)
from robot_sim.physics.files.world_file import fill as fill_world
from robot_sim.physics.world import NameTaken, World
from robot_sim.simulator import Simulator

logger = logging.getLogger(f"rosout.{__name__}")


def fill(sim: Simulator, source: Source | None) -> None:
    """Loads a world file into an empty world, as gzserver does: models, gravity and physics step.

    `EMPTY` is a ground plane, None nothing. Raises RobotEnvError if the file can't be read or simulated.
    """
    if source is None:
        return
    world = empty_world() if source == EMPTY else _read(source)
    for warning in world.warnings:
        logger.warning("world %s: %s", _shown(source), warning)
    sim.set_time_step(world.time_step)
    sim.world.set_gravity(world.gravity)
    sim.world.set_solver(world.solver)
    sim.world.lights.update(world.lights)
    for name, error in fill_world(sim.world, world.models):
        if error is not None:
            raise RobotEnvError(f"world {_shown(source)}: model '{name}': {error}") from error


def _read(source: Source) -> WorldDescription:
    try:
        if is_text(source):
            return parse_world(str(source), resources())
        path = locate(source)
        need_file(path)
        return load_world(path, resources())
    except (DescriptionError, RobotEnvError) as error:
        raise RobotEnvError(f"world {_shown(source)}: {error}") from error


def world_models(source: Source | None) -> dict[str, ModelDescription]:
    """Returns the models of a world file; none for `EMPTY`. Raises RobotEnvError if it can't be read."""
    return {} if source is None or source == EMPTY else _read(source).models


def loose_joints(source: Source | None, objects: Sequence[Object]) -> list[tuple[str, str]]:
    """Returns model and name of the world's and the objects' movable joints, which a reset puts at 0."""
    models = {**world_models(source), **{each.name: object_model(each) for each in objects}}
    return [(name, each.name) for name, model in models.items() for each in model.movable_joints]


def object_model(thing: Object) -> ModelDescription:
    """Reads an object's file; raises RobotEnvError if that fails, or if it describes a light."""
    text = read_text(thing.file)
    try:
        entity = read_entity(text, thing.name, resources(), Reading())
    except DescriptionError as error:
        raise RobotEnvError(f"the object '{thing.name}' ({_shown(thing.file)}): {error}") from error
    if isinstance(entity, Light):
        raise RobotEnvError(f"the object '{thing.name}' is a light; an object is a model")
    return entity


def spawn(world: World, thing: Object) -> None:
    """Spawns an object; raises RobotEnvError if its file can't be simulated, or its name is taken."""
    model = object_model(thing)
    try:
        world.spawn(thing.name, model, thing.pose.compose(model.initial_pose))
    except NameTaken as error:
        raise RobotEnvError(
            f"the object '{thing.name}': the world has a model of that name; give it another one"
        ) from error
    except DescriptionError as error:
        raise RobotEnvError(f"the object '{thing.name}' ({_shown(thing.file)}): {error}") from error


def _shown(source: Source) -> str:
    return "given as text" if is_text(source) else str(source)
