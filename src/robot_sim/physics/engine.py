"""The interface of a physics engine. To add one: subclasses of Engine and Body, named in `engines`."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

from robot_sim.physics.description import DescriptionError, Inertia, ModelDescription
from robot_sim.physics.pose import ZERO, Pose, Vector, conjugate, rotate, subtract

Twist = tuple[Vector, Vector]
"""Linear [m/s] and angular [rad/s] velocity in world axes."""

FURTHEST = math.pi
"""The largest motion [rad, m] in a step of a joint, or of a free base that carries joints. Beyond half a turn
a rotation has no direction, and explicit terms, such as centrifugal forces, add energy."""
FASTEST = 1e9
"""The largest velocity [rad/s, m/s] of a body without joints, and of a motor."""
GEAR = 0.05  # of the error of a joint that follows another one is mended in a step
STRONGEST = 1e9  # [N m, N]; of a motor or gear without a limit: solvers need a finite number
OVERLAP = 0.0025
"""The depth [m] from which two links overlap; PyBullet's margins around two meshes are 2 mm."""


class Side(NamedTuple):
    """One of two bodies that touch.

    `collisions` names the link's collisions that may touch: just one if the engine knows which.
    """

    body: "Body"
    link: str
    collisions: tuple[str, ...]


class Contact(NamedTuple):
    """A point at which two bodies touch; forces and normal are those on the first one, in world axes."""

    point: Vector  # [m]
    force: Vector  # [N] along the normal
    friction: Vector  # [N] across it
    normal: Vector  # of length 1, towards the first body
    depth: float  # [m] by which they overlap
    first: Side
    second: Side


class Body(ABC):
    """A model in the engine. Its joints are the movable ones, in document order."""

    implicit_damping: ClassVar[bool]
    """Whether joint damping acts on the velocity after the step, instead of before it."""
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    overlapping: frozenset[frozenset[str]] = frozenset()
    """Pairs of links that don't collide since they overlap where the model was loaded."""
    moved = True
    """Whether something other than time has moved it since this was set to False."""

    @abstractmethod
    def joint_states(self) -> Sequence[Sequence[float]]:
        """Returns for each joint a sequence that starts with position [rad, m] and velocity [rad/s, m/s]."""

    @abstractmethod
    def apply_efforts(self, efforts: Sequence[float]) -> None:
        """Applies one effort [N m, N] to each joint during the next step only."""

    @abstractmethod
    def add_effort(self, index: int, effort: float) -> None:
        """Adds an effort [N m, N] to joint `index` during the next step, on top of all others."""

    @abstractmethod
    def add_wrench(self, link: str, force: Vector, torque: Vector) -> None:
        """Adds a force [N] at the centre of mass of `link` and a torque [N m], in world axes, during the
        next step."""

    @abstractmethod
    def set_inertia(self, link: str, old: Inertia | None, new: Inertia) -> bool:
        """Gives `link` another inertia. Returns False, and does nothing, if the model has to be reloaded."""

    @abstractmethod
    def set_damping(self, index: int, damping: float) -> None:
        """Sets the viscous damping [N m s/rad, N s/m] of joint `index`.

        Where it acts explicitly, more than inertia / time step would drive the joint instead of damping it.
        """

    @abstractmethod
    def set_limits(self, index: int, lower: float, upper: float) -> None:
        """Sets the stops [rad, m] of joint `index`; none if `lower` is above `upper`."""

    @abstractmethod
    def set_motor(self, index: int, velocity: float, effort: float) -> None:
        """Has a motor drive joint `index` at `velocity` [rad/s, m/s] with at most `effort` [N m, N].

        At velocity 0 it is dry friction.
        """

    @abstractmethod
    def set_gear(self, joint: str, effort: float) -> None:
        """Has at most `effort` [N m, N] move a joint that follows another one (`Mimic`); 0 for none."""

    @abstractmethod
    def set_friction(self, link: str, factor: float) -> None:
        """Multiplies the friction that the collisions of `link` were loaded with by `factor`."""

    @abstractmethod
    def motion(self) -> Any:
        """Returns where it is, how it moves, and what acts on it in the next step."""

    @abstractmethod
    def move(self, motion: Any) -> None:
        """Takes a motion that a body of the same description has had.

        An engine may round: the same motion always leads to the same bits, but not to those that led to it.
        """

    @abstractmethod
    def reset_joint(self, index: int, position: float, velocity: float = 0.0) -> None:
        """Puts joint `index` at `position` with `velocity`; the other joints stay."""

    @abstractmethod
    def reset_base(self, pose: Pose, twist: Twist = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))) -> None:
        """Puts the root link's frame at `pose`, its origin moving with `twist`."""

    @abstractmethod
    def set_base_twist(self, twist: Twist) -> None:
        """Gives a free root link's frame another velocity; nothing moves by that."""

    @abstractmethod
    def link_state(self, name: str) -> tuple[Pose, Twist]:
        """Returns pose and twist of the frame of link `name`, in the world."""

    def link_poses(self) -> dict[str, Pose]:
        """Returns the poses of all links' frames, in the world, in the order of `link_names`."""
        return {name: self.link_state(name)[0] for name in self.link_names}

    @abstractmethod
    def set_link_gravity(self, name: str, on: bool) -> None:
        """Lets gravity act on link `name`, or not."""


class EngineSettings(NamedTuple):
    """Gravity [m/s²], step [s], iterations of the solver in a step, and the fastest end of overlaps [m/s].

    `Shape.max_vel` bounds the speed at which contacts end overlaps of a shape, too.
    """

    gravity: Vector = ZERO
    time_step: float = 0.001
    iterations: int = 50
    separation: float = math.inf


LinkOf = tuple[Body, str]
"""A body and the name of a link of it."""


class Engine(ABC):
    """A dynamics engine with velocity-stepped articulated bodies.

    Velocities are cut at FURTHEST in a step, or at FASTEST, before they are integrated.
    """

    @abstractmethod
    def load(self, description: ModelDescription, pose: Pose) -> Body:
        """Adds a model with its root link's frame at `pose`, its joints at zero.

        Raises DescriptionError if the engine can't take it.
        """

    def load_all(self, models: Sequence[tuple[ModelDescription, Pose]]) -> Iterator[Body | DescriptionError]:
        """Adds models in order; yields each one's body, or why the engine can't take it."""
        for description, pose in models:
            try:
                yield self.load(description, pose)
            except DescriptionError as error:
                yield error

    @abstractmethod
    def remove(self, body: Body) -> None:
        """Takes a body out of the world."""

    def renewed(self, bodies: Sequence[tuple[ModelDescription, Body]]) -> list[Body]:
        """Returns bodies in the same state to use instead of `bodies`, which are all of the world's.

        The world calls it before it loads a model. An engine that can't free the memory of removed bodies
        moves into a new world now and then; motors and dampings then have to be set again.
        """
        return [body for _, body in bodies]

    @abstractmethod
    def fasten(self, first: LinkOf, second: LinkOf, pose: Pose) -> int:
        """Keeps a link of a body at `pose`, seen from another one's; the two don't collide any more.

        Returns the number by which to unfasten it. It ends with either of the bodies.
        """

    @abstractmethod
    def unfasten(self, number: int) -> None:
        """Ends what `fasten` began."""

    @abstractmethod
    def configure(self, settings: EngineSettings) -> None:
        """Sets what acts in all steps from now on."""

    @abstractmethod
    def step(self) -> None:
        """Integrates the world by one time step."""

    def forget_contacts(self) -> None:
        """Forgets contacts of earlier steps, before the bodies of a new episode are placed."""

    @abstractmethod
    def contacts(self) -> list[Contact]:
        """Returns where bodies touched in the last step."""

    @abstractmethod
    def order(self) -> Sequence[Body]:
        """Returns the bodies in the order in which they were loaded: the solver's result may depend on it."""

    @abstractmethod
    def fastened(self) -> dict[int, Pose]:
        """Returns where each second link is kept, by number, as the engine has it."""

    @abstractmethod
    def refasten(self, welds: Mapping[int, tuple[LinkOf, LinkOf, Pose]]) -> None:
        """Keeps these links, and no others, where they were `fastened` at another time."""

    @abstractmethod
    def close(self) -> None:
        """Frees the engine's memory; it can't be used afterwards."""


def seen_from(state: tuple[Pose, Twist], frame: tuple[Pose, Twist]) -> tuple[Pose, Twist]:
    """Returns a state relative to a frame, as Gazebo does: without the ω × r term."""
    back = conjugate(frame[0].orientation)
    linear, angular = (
        rotate(back, subtract(own, other)) for own, other in zip(state[1], frame[1], strict=True)
    )
    return state[0].relative_to(frame[0]), (linear, angular)
