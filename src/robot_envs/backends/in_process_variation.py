"""Robots' figures in a world of this process, changed by the same functions as behind Gazebo's services."""

from collections.abc import Mapping
from dataclasses import replace

from bullet_gazebo.physics.description import DescriptionError, Inertia
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import Vector
from bullet_gazebo.physics.properties import (
    JointProperties,
    PropertyError,
    link_inertia,
    set_joint_properties,
    set_link_friction,
    set_link_properties,
)
from bullet_gazebo.simulator import Simulator
from robot_envs.errors import SimulatorError
from robot_envs.variation.applying import JointFigures, PidFigures
from robot_envs.variation.parts import Part


class InProcessChanges:
    """What can be changed of robots; see `robot_envs.variation.applying.Changeable`.

    Args:
        sim: of the world that they are in.
    """

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._robots = {each.model.name: each for each in sim.robots}

    def _model(self, part: Part) -> Model:
        return self._robots[part.robot.model].model

    def link(self, link: Part) -> Inertia:
        return link_inertia(self._model(link), link.name)

    def set_link(self, link: Part, inertia: Inertia) -> None:
        model = self._model(link)
        gravity = model.body.link_gravity(link.name)
        try:
            set_link_properties(self._sim.world, model, link.name, inertia, gravity)
        except (PropertyError, DescriptionError) as error:
            raise SimulatorError(f"link {link.name} can't be changed: {error}") from error

    def set_joint(self, joint: Part, figures: JointFigures) -> None:
        wanted = JointProperties(damping=figures.damping, motor_effort=figures.friction)
        step = self._sim.world.time_step
        try:
            set_joint_properties(self._model(joint), joint.name, wanted, step)
        except PropertyError as error:
            raise SimulatorError(f"joint {joint.name} can't be changed: {error}") from error

    def set_surface(self, link: Part, factor: float) -> None:
        try:
            set_link_friction(self._model(link), link.name, factor)
        except PropertyError as error:
            raise SimulatorError(
                f"surfaces of link {link.name} can't be changed: {error}"
            ) from error

    def pids(self, controller: Part) -> Mapping[str, PidFigures]:
        pids = self._robots[controller.robot.model].manager.get(controller.name).pids.items()
        return {place: PidFigures(pid.gains.p, pid.gains.i, pid.gains.d) for place, pid in pids}

    def set_pid(self, controller: Part, place: str, gains: PidFigures) -> None:
        manager = self._robots[controller.robot.model].manager
        pid = manager.get(controller.name).pids[place]
        pid.gains = replace(pid.gains, **gains._asdict())
        manager.loops_changed()

    def gravity(self) -> Vector:
        return self._sim.world.gravity

    def set_gravity(self, gravity: Vector) -> None:
        """As set_physics_properties does it, which sets the step and the solver, too."""
        world = self._sim.world
        world.set_gravity(gravity)
        self._sim.set_time_step(world.time_step)
        world.set_solver(world.solver)
