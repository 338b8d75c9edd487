"""The physics world: models by name, Gazebo's name look-up, and the step that integrates them all."""

from typing import NamedTuple

from bullet_gazebo.physics.description import Link, ModelDescription, Shape
from bullet_gazebo.physics.engine import Engine, Twist
from bullet_gazebo.physics.model import AT_REST, Model
from bullet_gazebo.physics.pose import Pose, Vector

GRAVITY: Vector = (0.0, 0.0, -9.8)  # [m/s²], Gazebo's default
TIME_STEP = 0.001  # [s], Gazebo's default
WORLD_FRAMES = ("", "world", "map", "/map")


class NameTaken(ValueError):
    """A model of that name is in the world already."""


class Entity(NamedTuple):
    """What a name stands for: `kind` is model, link or joint; `name` is plain."""

    kind: str
    model: Model
    name: str


class World:
    """All models and the engine under them. Not thread-safe: its owner serialises access."""

    def __init__(
        self, engine: Engine, gravity: Vector = GRAVITY, time_step: float = TIME_STEP
    ) -> None:
        self.engine = engine
        self.models: dict[str, Model] = {}
        self._entities: dict[str, Entity] = {}
        self._joints: dict[str, Entity] = {}
        self.time_step = time_step
        self.gravity = gravity
        engine.set_gravity(gravity)
        engine.set_time_step(time_step)

    def spawn(self, name: str, description: ModelDescription, pose: Pose) -> Model:
        """Adds a model with its frame at `pose`.

        Errors: NameTaken; DescriptionError if the engine can't take it.
        """
        if name in self.models:
            raise NameTaken(name)
        body = self.engine.load(description, pose.compose(description.root_pose))
        self.models[name] = Model(name, description, body, pose)
        self._index()
        return self.models[name]

    def delete(self, name: str) -> None:
        """Takes model `name` out of the world; KeyError if there is none."""
        self.engine.remove(self.models.pop(name).body)
        self._index()

    def model(self, name: str) -> Model | None:
        """Returns what the name look-up finds, if it is a model (gazebo_api.md section 2.0)."""
        entity = self._entities.get(name)
        return entity.model if entity is not None and entity.kind == "model" else None

    def joint(self, name: str) -> tuple[Model, str] | None:
        """Returns the first model that has joint `name` (plain or scoped), and the joint's plain name."""
        entity = self._joints.get(name)
        return None if entity is None else (entity.model, entity.name)

    def frame(self, name: str) -> tuple[Pose, Twist] | None:
        """Returns pose and twist of the named model or link, or of the world; None if unknown."""
        entity = self._entities.get(name)
        if entity is None or entity.kind == "joint":
            return (Pose(), AT_REST) if entity is None and name in WORLD_FRAMES else None
        if entity.kind == "model":
            return entity.model.state()
        return entity.model.link_state(entity.name)

    def step(self) -> None:
        """Integrates all models by one time step."""
        self.engine.step()

    def reset(self, joints: bool) -> None:
        """Returns every model to where it was spawned, at rest; with `joints`, every joint to zero."""
        for model in self.models.values():
            model.reset(joints)

    def close(self) -> None:
        self.models.clear()
        self.engine.close()

    def _index(self) -> None:
        """Maps plain and scoped names to what a depth-first walk from the world's root finds first."""
        self._entities, self._joints = {}, {}
        for model in self.models.values():
            self._entities.setdefault(model.name, Entity("model", model, model.name))
            for kind, names in (("link", model.link_names), ("joint", model.joint_names)):
                for name in names:
                    entity = Entity(kind, model, name)
                    for key in (f"{model.name}::{name}", name):
                        self._entities.setdefault(key, entity)
                        if kind == "joint":
                            self._joints.setdefault(key, entity)


def ground_plane() -> ModelDescription:
    """Returns Gazebo's `ground_plane`: a static infinite plane through the origin."""
    link = Link("link", collisions=[Shape("plane", name="collision")])
    return ModelDescription("ground_plane", {"link": link}, {}, root="link", static=True)
