"""The physics world: models by name, Gazebo's name look-up, and the step that integrates them all."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robot_sim.physics import passive_forces
from robot_sim.physics.actor import Actor
from robot_sim.physics.description import DescriptionError, Inertia, Light, Link, ModelDescription, Shape
from robot_sim.physics.engine import Body, Contact, Engine, EngineSettings, Side, Twist
from robot_sim.physics.entity_names import EntityNames
from robot_sim.physics.model import AT_REST, Model
from robot_sim.physics.pose import Pose, Vector
from robot_sim.snapshot import SnapshotError
from robot_sim.state_dict import Shared

GRAVITY: Vector = (0.0, 0.0, -9.8)  # [m/s²], Gazebo's default
TIME_STEP = 0.001  # [s], Gazebo's default
MOST_ITERATIONS = 1000  # of the solver in a step; more would only block the world
WORLD_FRAMES = ("", "world", "map", "/map")
PROPERTIES = "inertia or gravity of a link", "stop or damping of a joint", "friction of a link"
"""What `Model.properties` returns, in order."""


@dataclass(frozen=True)
class SolverSettings:
    """ODE's solver parameters, with sdformat's defaults (docs/contract/gazebo.md 2.20).

    Our engines have other solvers: only `iterations` and `contact_max_correcting_vel` have an effect.
    Clients read the others back.
    """

    auto_disable_bodies: bool = False
    precon_iterations: int = 0
    iterations: int = 50
    sor: float = 1.3
    contact_surface_layer: float = 0.001  # [m]
    contact_max_correcting_vel: float = 100.0  # [m/s]
    cfm: float = 0.0
    erp: float = 0.2
    max_contacts: int = 20


@dataclass(eq=False)
class Attachment:
    """Two links that are fixed to each other; the second one is at `pose` in the first one's frame."""

    first: tuple[Model, str]
    second: tuple[Model, str]
    pose: Pose
    number: int = 0  # the engine's

    def joins(self, model: Model) -> bool:
        """Returns whether one of the links is of that model."""
        return model in (self.first[0], self.second[0])


class NameTaken(ValueError):
    """The world already has a model of that name."""


class World(Shared):
    """All models, and the engine that simulates them. Not thread-safe: its owner serialises access."""

    def __init__(self, engine: Engine, gravity: Vector = GRAVITY, time_step: float = TIME_STEP) -> None:
        self.engine = engine
        self.models: dict[str, Model] = {}
        self.lights: dict[str, Light] = {}
        self.attachments: list[Attachment] = []
        self.clock: Callable[[], float] = lambda: 0.0  # of the simulator
        self.version = 0  # counts changes of models and lights
        self._names = EntityNames()
        self._special: list[Model] = []  # with springs, decay or a kinematic link
        self._recalled: Sequence[Contact] | None = None  # until the next step
        self.time_step, self.gravity = time_step, gravity
        self.set_solver(SolverSettings())

    def spawn(self, name: str, description: ModelDescription, pose: Pose) -> Model:
        """Adds a model with its frame at `pose`.

        Raises NameTaken if there is a model of that name, DescriptionError if the engine can't take it.
        """
        if name in self.models:
            raise NameTaken(name)
        self._renew()
        body = self.engine.load(description, pose.compose(description.root_pose))
        return self.admit(name, description, body, pose)

    def admit(self, name: str, description: ModelDescription, body: Body, pose: Pose) -> Model:
        """Adds a model whose body the engine has."""
        given = name, description, body, pose
        now = lambda: self.clock()  # noqa: E731, PLW0108 - a simulator replaces the clock
        model = Actor(now, *given) if description.script else Model(*given)
        try:
            model.apply_damping(self.time_step)
            model.put_followers()
            model.close_loops((), model.joint_states())
            if description.start is not None:
                model.begin(description.start)
        except Exception:
            self.engine.remove(body)
            raise
        if model.softened:
            joints = ", ".join(sorted(model.softened))
            description.warnings.append(f"springs too stiff for the step are softened: {joints}")
        if body.overlapping:
            pairs = sorted(" and ".join(sorted(pair)) for pair in body.overlapping)
            description.warnings.append(
                f"links that overlap in the initial pose don't collide with each other: {', '.join(pairs)}"
            )
        self.models[model.name] = model
        self._index(model)
        model.number = self.version
        return model

    def delete(self, name: str) -> None:
        """Removes model `name`."""
        model = self.models.pop(name)
        for each in self._of(model):
            self.detach(each)
        self._recalled = None  # it may be among them
        self.engine.remove(model.body)
        self._names = EntityNames()
        self._index(*self.models.values())

    def model(self, name: str) -> Model | None:
        """Returns the model that the name look-up finds, if any (docs/contract/gazebo.md 2.0)."""
        entity = self._names.entities.get(name)
        return entity.model if entity is not None and entity.kind == "model" else None

    def link(self, name: str) -> tuple[Model, str] | None:
        """Returns model and plain name of the link that the name look-up finds, if any."""
        entity = self._names.entities.get(name)
        return (entity.model, entity.name) if entity is not None and entity.kind == "link" else None

    def joint(self, name: str) -> tuple[Model, str] | None:
        """Returns the first model that has joint `name` (plain or scoped), and the joint's plain name."""
        entity = self._names.joints.get(name)
        return None if entity is None else (entity.model, entity.name)

    def frame(self, name: str) -> tuple[Pose, Twist] | None:
        """Returns pose and twist of the named model, link or collision, or of the world; None if unknown."""
        entity = self._names.entities.get(name)
        if entity is None or entity.kind == "joint":
            return (Pose(), AT_REST) if entity is None and name in WORLD_FRAMES else None
        if entity.kind == "model":
            return entity.model.state()
        if entity.kind == "link":
            return entity.model.link_state(entity.name)
        pose, twist = entity.model.link_state(entity.link)
        return pose.compose(entity.model.collisions(entity.link)[entity.name].pose), twist

    def is_world_frame(self, name: str) -> bool:
        """Returns whether `name` refers to the world itself: an entity of that name takes precedence."""
        return name in WORLD_FRAMES and name not in self._names.entities

    def attach(self, first: tuple[Model, str], second: tuple[Model, str]) -> Attachment:
        """Fixes a link to another where they are now, until `detach`, a reset, or a deletion."""
        poses = [model.link_state(link)[0] for model, link in (first, second)]
        made = Attachment(first, second, poses[1].relative_to(poses[0]))
        self._fasten(made)
        self.attachments.append(made)
        return made

    def detach(self, attachment: Attachment) -> None:
        """Ends an attachment."""
        self.attachments.remove(attachment)
        self.engine.unfasten(attachment.number)

    def _fasten(self, attachment: Attachment) -> None:
        (one, link), (other, its) = attachment.first, attachment.second
        attachment.number = self.engine.fasten((one.body, link), (other.body, its), attachment.pose)

    def _of(self, model: Model) -> list[Attachment]:
        return [each for each in self.attachments if each.joins(model)]

    def with_attached(self, models: Iterable[Model]) -> set[Model]:
        """Returns models and everything attached to them, directly or through others."""
        reached = set(models)
        waiting = list(reached)
        while waiting:
            for each in self._of(waiting.pop()):
                fresh = {each.first[0], each.second[0]} - reached
                reached |= fresh
                waiting += fresh
        return reached

    def set_gravity(self, gravity: Vector) -> None:
        """Sets the acceleration of gravity [m/s²]."""
        self.gravity = gravity
        self._configure()

    def set_time_step(self, time_step: float) -> None:
        """Sets the length of a physics step [s]."""
        self.time_step = time_step
        self._configure()
        for model in self.models.values():
            model.apply_damping(time_step)

    def set_solver(self, solver: SolverSettings) -> None:
        """Stores the solver's settings, and applies those that the engine supports."""
        self.solver = solver
        self._configure()

    def _configure(self) -> None:
        iterations = max(1, min(self.solver.iterations, MOST_ITERATIONS))
        separation = self.solver.contact_max_correcting_vel
        self.engine.configure(EngineSettings(self.gravity, self.time_step, iterations, separation))

    def set_inertia(self, model: Model, link: str, inertia: Inertia) -> None:
        """Changes the inertia of a link of `model`; poses and velocities stay.

        Raises DescriptionError if the engine can't take it; the model is as it was then.
        """
        self._renew()  # from descriptions that are still those of the bodies
        record = model.description.links[link]
        old, record.inertia = record.inertia, inertia
        if model.description.static or record.kinematic:
            return
        if not model.body.set_inertia(link, old, inertia):
            try:
                self._reload(model)
            except DescriptionError:
                record.inertia = old
                raise
        model.apply_damping(self.time_step)

    def _reload(self, model: Model) -> None:
        """Loads a model anew, as the last one in the engine's order."""
        fresh = self.engine.load(model.description, model.root_state()[0])
        stale, self._recalled = model.body, None
        for each in self._of(model):
            self.engine.unfasten(each.number)
        model.move_into(fresh)
        self.engine.remove(stale)
        for each in self._of(model):
            self._fasten(each)

    def step(self) -> None:
        """Integrates all models by one time step."""
        self._recalled = None
        if not self._special:
            self.engine.step()
            return
        for model in self._special:
            passive_forces.apply(model)
        held = [(model, passive_forces.kinematic_twist(model)) for model in self._special if model.kinematic]
        self.engine.step()
        for model, twist in held:
            passive_forces.set_kinematic_twist(model, twist)

    def contacts(self) -> Sequence[Contact]:
        """Returns the last step's contacts; after a restore, those of the step before the snapshot."""
        return self.engine.contacts() if self._recalled is None else self._recalled

    def reset(self, joints: bool) -> None:
        """Returns every model to where it was spawned, at rest; with `joints`, every joint to zero.

        Nothing is attached any more.
        """
        for attachment in list(self.attachments):
            self.detach(attachment)
        self.engine.forget_contacts()
        self._recalled = None
        for model in self.models.values():
            model.reset(joints)

    def state_dict(self) -> dict[str, Any]:
        """Returns the state that its steps depend on, without models and properties set by services.

        Engines can't save contacts, so contacts restart now and after each load. The next step finds them
        again, but PyBullet's solver starts without the forces of the last one.
        """
        contacts, fastened = self.contacts(), self.engine.fastened()
        self._refasten(fastened)  # in the order that a load leads to
        names = {id(model.body): name for name, model in self.models.items()}
        state = {
            "models": {name: model.state_dict() for name, model in self.models.items()},
            "order": self._order(),
            "gravity": self.gravity,
            "time_step": self.time_step,
            "solver": vars(self.solver).copy(),
            "attachments": [
                ((a.first[0].name, a.first[1]), (a.second[0].name, a.second[1]), a.pose, a.number)
                for a in self.attachments
            ],
            "fastened": fastened,
            "contacts": [
                (*each[:5], *((names[id(side.body)], *side[1:]) for side in each[5:])) for each in contacts
            ],
        }
        self._recall(contacts)
        return state

    def _refasten(self, fastened: Mapping[int, Pose]) -> None:
        ends = {each.number: (each.first, each.second) for each in self.attachments}
        welds = {}
        for number, pose in fastened.items():
            (one, link), (other, its) = ends[number]
            welds[number] = (one.body, link), (other.body, its), pose
        self.engine.refasten(welds)

    def _order(self) -> list[str]:
        """Returns the names of the models in the engine's order, without planes (`fingerprint`)."""
        solid = [model for model in self.models.values() if not model.description.is_plane]
        names = {id(model.body): model.name for model in solid}
        return [names[id(body)] for body in self.engine.order() if id(body) in names]

    def _recall(self, contacts: Sequence[Contact]) -> None:
        self.engine.forget_contacts()
        self._recalled = contacts

    def check_state(self, state: Mapping[str, Any], pushed: Iterable[tuple[str, str]] = ()) -> None:
        """Checks that a state fits this world, and that it has `pushed`, models with their links.

        Raises SnapshotError if the models or their properties have changed.
        """
        now = self.gravity, self.time_step, vars(self.solver)
        if now != (state["gravity"], state["time_step"], state["solver"]):
            raise SnapshotError("gravity, time step or solver have changed since the snapshot")
        if sorted(self._order()) != sorted(map(str, state["order"])):
            raise SnapshotError(
                f"it has the models {state['order']!r:.300}, and here are {self._order()!r:.300}"
            )
        ends = [end for each in state["attachments"] for end in each[:2]]
        attached = {name for name, _ in ends}
        if sorted(state["fastened"]) != sorted(number for *_, number in state["attachments"]):
            raise SnapshotError("its attachments aren't what is fastened")
        for name, link in (*ends, *pushed):
            if name not in self.models or link not in self.models[name].link_names:
                raise SnapshotError(f"something acts on the link '{name}::{link}', which isn't here")
        touched = {side[0] for each in state["contacts"] for side in each[5:]}
        if missing := sorted(touched - set(self.models)):
            raise SnapshotError(f"something touches the model '{missing[0]}', which isn't here")
        for name, own in state["models"].items():
            if name not in self.models:  # a plane
                continue
            model = self.models[name]
            properties = zip(PROPERTIES, model.properties(), own["properties"], strict=True)
            if changed := [name for name, one, other in properties if one != other]:
                raise SnapshotError(
                    f"model '{name}' has another {' and '.join(changed)} than in the snapshot"
                )
            if name in attached and model.loads != own["loads"]:
                raise SnapshotError(
                    f"model '{name}' was attached, and its links have been changed since the snapshot"
                )

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Loads what `state_dict` returned, after `check_state`."""
        models = self.models
        pairs = list(zip(self._order(), state["order"], strict=True))
        while pairs and pairs[0][0] == pairs[0][1]:
            del pairs[0]
        for _, name in pairs:  # links were changed, and their models loaded anew
            self._reload(models[name])
            models[name].apply_damping(self.time_step)
        known = {(a.first, a.second, a.pose, a.number): a for a in self.attachments}
        made_of = [
            ((models[one], link), (models[two], its), pose, number)
            for (one, link), (two, its), pose, number in state["attachments"]
        ]
        self.attachments = [known.get(each) or Attachment(*each) for each in made_of]
        self._refasten(state["fastened"])
        for name, own in state["models"].items():
            if name in models:
                models[name].load_state_dict(own)
        self._recall(
            [
                Contact(*each[:5], *(Side(models[name].body, *rest) for name, *rest in each[5:]))
                for each in state["contacts"]
            ]
        )

    def close(self) -> None:
        self.models.clear()
        self.engine.close()

    def _renew(self) -> None:
        """Lets the engine free the memory of removed bodies."""
        models = list(self.models.values())
        bodies = self.engine.renewed([(model.description, model.body) for model in models])
        fresh = [(m, body) for m, body in zip(models, bodies, strict=True) if body is not m.body]
        for model, body in fresh:
            model.go_on_in(body)
        for each in self.attachments if fresh else ():  # all are in a new world of the engine
            self._fasten(each)

    def _index(self, *models: Model) -> None:
        """Adds new models to the name look-up."""
        self.version += 1
        self._special = [model for model in self.models.values() if passive_forces.are_on(model)]
        for model in models:
            self._names.add(model)


def ground_plane() -> ModelDescription:
    """Returns Gazebo's `ground_plane`: a static infinite plane through the origin."""
    link = Link("link", collisions=[Shape("plane", name="collision")])
    return ModelDescription("ground_plane", {"link": link}, {}, root="link", static=True)
