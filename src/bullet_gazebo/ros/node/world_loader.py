"""Puts a world file into the simulator when it starts."""

from collections.abc import Callable
from dataclasses import replace

import rospy

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.files.reading import Reading
from bullet_gazebo.physics.files.world_file import WorldDescription, empty_world, load_world
from bullet_gazebo.ros.plugins import PluginRegistry
from bullet_gazebo.ros.services.resource_paths import find_world, resources
from bullet_gazebo.ros.services.spawn_services import at_most, warn
from bullet_gazebo.simulator import Simulator


def read_world(name: str, interrupted: Callable[[], bool]) -> WorldDescription:
    """Returns the world of file `name`; one with a ground plane only, and a warning, if it is unusable.

    Reading it ends early once `interrupted` returns true.
    """
    path = find_world(name)
    if path is None:
        rospy.logwarn(
            "World file '%s' is not found: the world is empty but for a ground plane", name
        )
        return empty_world()
    try:
        world = load_world(path, resources(), Reading(interrupted))
    except DescriptionError as error:
        rospy.logerr("%s. The world is empty but for a ground plane", error)
        return empty_world()
    for warning in at_most(world.warnings):
        rospy.logwarn("World '%s': %s", path, warning)
    if world.left_out:
        rospy.logwarn(
            "World '%s': not simulated here: %s", path, ", ".join(at_most(world.left_out))
        )
    return world


def fill_world(sim: Simulator, world: WorldDescription, interrupted: Callable[[], bool]) -> None:
    """Sets gravity and step, and adds lights and models; one that the engine can't take is left out.

    No more models are added once `interrupted` returns true.
    """
    with sim.lock:
        sim.set_time_step(world.time_step)
        sim.max_update_rate = world.update_rate
        sim.world.set_gravity(world.gravity)
        if world.iterations is not None:
            sim.world.set_solver(replace(sim.world.solver, iterations=world.iterations))
        sim.world.lights.update(world.lights)
        for name, description in world.models.items():
            if interrupted():
                return
            try:
                sim.world.spawn(name, description, description.initial_pose)
            except DescriptionError as error:
                rospy.logwarn("Model '%s' is left out: %s", name, error)


def load_plugins(sim: Simulator, plugins: PluginRegistry) -> None:
    """Starts the plugins of the models that the world began with."""
    with plugins.time_held("the world"):
        for model in list(sim.world.models.values()):
            plugins.load(model, "")
            warn(model.name, model.description)
