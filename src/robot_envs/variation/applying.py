"""Changes robots as a variation says, in one order on all backends, and gives them back as found."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from bullet_gazebo.physics.description import Inertia
from bullet_gazebo.physics.pose import Vector, scale
from robot_envs.scene import Scene
from robot_envs.variation.parts import Parts, RobotPart
from robot_envs.variation.variation import Variation, scaled


class JointFigures(NamedTuple):
    """Viscous [N s/m, N m s/rad] and dry [N, N m] friction of a joint; None: it stays as it is."""

    damping: float | None = None
    friction: float | None = None


class PidFigures(NamedTuple):
    """Gains of a PID: p, i, d [command per error, per error s, s per error]."""

    p: float
    i: float
    d: float


class Changeable(Protocol):
    """Reads and changes what a variation may name, in the world that the robots move in.

    Raises:
        SimulatorError: by each of them, if the world refuses, or doesn't answer.
    """

    def link(self, link: RobotPart) -> Inertia:
        """What a link has now."""
        ...

    def set_link(self, link: RobotPart, inertia: Inertia) -> None:
        """Gives a link other figures; its axes stay."""
        ...

    def set_joint(self, joint: RobotPart, figures: JointFigures) -> None:
        """Gives a joint other figures."""
        ...

    def set_surface(self, link: RobotPart, factor: float) -> None:
        """Gives a link's surfaces so many times the friction of their file."""
        ...

    def pids(self, controller: RobotPart) -> Mapping[str, PidFigures]:
        """The gains of a controller's PIDs now, by their place below the controller."""
        ...

    def set_pid(self, controller: RobotPart, place: str, gains: PidFigures) -> None:
        """Gives a PID other gains."""
        ...

    def gravity(self) -> Vector:
        """The world's now [m/s²]."""
        ...

    def set_gravity(self, gravity: Vector) -> None:
        """Gives the world another one [m/s²]."""
        ...


class Applier:
    """Applies variations to robots as they were found; what their files alone tell is taken from those.

    Args:
        scene: the robots.
        world: what they are in.
    """

    def __init__(self, scene: Scene, world: Changeable) -> None:
        self._scene, self._world = scene, world
        self._parts: Parts | None = None  # None: there was nothing to vary yet
        self._last = Variation()
        self._links: dict[str, Inertia] = {}
        self._pids: dict[str, Mapping[str, PidFigures]] = {}
        self._gravity: Vector | None = None

    def __call__(self, variation: Variation) -> None:
        """Gives the robots their own figures, with what the variation says.

        Raises:
            SimulatorError: for a name that isn't there, or if the world refuses.
        """
        if self._parts is None and variation.is_nominal:
            return
        parts = self._parts = self._parts or Parts(self._scene)
        links = {name: parts.link(name) for name in (*variation.links, *variation.surfaces)}
        joints = {name: parts.joint(name) for name in (*variation.damping, *variation.friction)}
        tuned = {name: parts.controller(name) for name in variation.gains}
        self._last = variation  # all names are known: from here on there is something to undo
        for name, difference in variation.links.items():
            if name not in self._links:
                self._links[name] = self._world.link(links[name])
            self._world.set_link(links[name], scaled(self._links[name], difference))
        for name, joint in joints.items():
            self._rub(name, joint, variation)
        for name, factor in variation.surfaces.items():
            self._world.set_surface(links[name], factor)
        for name, controller in tuned.items():
            self._tune(name, controller, variation.gains[name])
        if variation.gravity is not None:
            if self._gravity is None:
                self._gravity = self._world.gravity()
            self._world.set_gravity(scale(self._gravity, variation.gravity))

    def _rub(self, name: str, joint: RobotPart, variation: Variation) -> None:
        own = joint.robot.links.joints[joint.name]  # Gazebo's services don't tell it
        damping, friction = variation.damping.get(name), variation.friction.get(name)
        self._world.set_joint(
            joint,
            JointFigures(
                None if damping is None else own.damping + damping,
                None if friction is None else own.friction + friction,
            ),
        )

    def _tune(self, name: str, controller: RobotPart, factor: float) -> None:
        if name not in self._pids:
            self._pids[name] = self._world.pids(controller)
        for place, gains in self._pids[name].items():
            self._world.set_pid(controller, place, PidFigures(*(factor * gain for gain in gains)))

    def undo(self) -> None:
        """Gives the robots their own figures back, if they were changed.

        Raises:
            SimulatorError: if the world refuses.
        """
        last = self._last
        if last != Variation():
            try:
                self(last.undone)
            finally:
                self._last = Variation()
