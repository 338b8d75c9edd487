"""Application of variations to robots, in one order on all backends, and their reversal."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

from robot_envs.scene import Scene
from robot_envs.variation.parts import Parts, RobotPart, varied
from robot_envs.variation.variation import Variation, scaled
from robot_sim.control.pid import Gains
from robot_sim.physics.description import Inertia
from robot_sim.physics.pose import Vector, scale


class Changeable(Protocol):
    """A world whose robots can be varied; each method raises SimulatorError if the world refuses."""

    def link(self, link: RobotPart) -> Inertia:
        """Returns a link's present inertia."""

    def set_link(self, link: RobotPart, inertia: Inertia) -> None:
        """Changes a link's inertia; its axes stay."""

    def set_joint(self, joint: RobotPart, damping: float | None, friction: float | None) -> None:
        """Changes a joint's viscous [N s/m, N m s/rad] and dry [N, N m] friction; None: unchanged."""

    def set_surface(self, link: RobotPart, factor: float) -> None:
        """Multiplies the friction of a link's surfaces, as its file has it."""

    def pids(self, controller: RobotPart) -> Mapping[str, Gains]:
        """Returns the present gains of a controller's PIDs, by their place below the controller."""

    def set_pid(self, controller: RobotPart, place: str, gains: Gains) -> None:
        """Changes p, i and d of a PID."""

    def gravity(self) -> Vector:
        """Returns the world's present gravity [m/s²]."""

    def set_gravity(self, gravity: Vector) -> None:
        """Changes the world's gravity [m/s²]."""


class Applier:
    """Applies variations to robots as they were found; a joint's own friction is taken from the file."""

    def __init__(self, scene: Scene, world: Changeable) -> None:
        self._scene, self._world = scene, world
        self._parts: Parts | None = None  # None: nothing was varied yet
        self._last = Variation()
        self._links: dict[str, Inertia] = {}  # as they were found, like the following
        self._pids: dict[str, Mapping[str, Gains]] = {}
        self._gravity: Vector | None = None

    def __call__(self, variation: Variation) -> None:
        """Applies a variation to the robots as they were found; raises SimulatorError for an unknown name."""
        if self._parts is None and variation.is_nominal:
            return
        parts = self._parts = self._parts or Parts(self._scene)
        links = varied(parts.links, "link", (*variation.links, *variation.surfaces))
        joints = varied(parts.joints, "joint", (*variation.damping, *variation.friction))
        controllers = varied(parts.controllers, "controller", variation.gains)
        self._last = variation  # all names are known: from here on there is something to undo
        for name, difference in variation.links.items():
            if name not in self._links:
                self._links[name] = self._world.link(links[name])
            self._world.set_link(links[name], scaled(self._links[name], difference))
        for name, joint in joints.items():
            own = joint.robot.links.joints[joint.name]  # Gazebo's services don't report it
            damping, friction = variation.damping.get(name), variation.friction.get(name)
            self._world.set_joint(
                joint,
                None if damping is None else own.damping + damping,
                None if friction is None else own.friction + friction,
            )
        for name, factor in variation.surfaces.items():
            self._world.set_surface(links[name], factor)
        for name, controller in controllers.items():
            if name not in self._pids:
                self._pids[name] = self._world.pids(controller)
            factor = variation.gains[name]
            for place, now in self._pids[name].items():
                wanted = replace(now, p=factor * now.p, i=factor * now.i, d=factor * now.d)
                self._world.set_pid(controller, place, wanted)
        if variation.gravity is not None:
            if self._gravity is None:
                self._gravity = self._world.gravity()
            self._world.set_gravity(scale(self._gravity, variation.gravity))

    def undo(self) -> None:
        """Restores the robots as they were found; raises SimulatorError if the world refuses."""
        last = self._last
        if last != Variation():
            try:
                self(last.undone)
            finally:
                self._last = Variation()
