"""Gazebo's name look-up: plain and scoped names of models, links, collisions and joints."""

from typing import NamedTuple

from robot_sim.physics.model import Model


class Entity(NamedTuple):
    """What a name refers to: `kind` is model, link, collision or joint; `name` is plain.

    `link` is the link of a collision.
    """

    kind: str
    model: Model
    name: str
    link: str = ""


class EntityNames:
    """Maps names, plain and scoped, to what a depth-first search from the world's root finds."""

    def __init__(self) -> None:
        self.entities: dict[str, Entity] = {}
        self.joints: dict[str, Entity] = {}  # joints alone, whatever else has their names

    def add(self, model: Model) -> None:
        """Adds a new model. The search finds it last, so existing entries stay."""
        self.entities.setdefault(model.name, Entity("model", model, model.name))
        for link in model.link_names:
            self._enter(Entity("link", model, link), f"{model.name}::{link}")
            for name in model.collisions(link):
                scoped = f"{model.name}::{link}::{name}"
                self._enter(Entity("collision", model, name, link), scoped)
        for name in model.all_joints:
            joint, scoped = Entity("joint", model, name), f"{model.name}::{name}"
            self._enter(joint, scoped)
            for key in (scoped, name):
                self.joints.setdefault(key, joint)

    def _enter(self, entity: Entity, scoped: str) -> None:
        for key in (scoped, entity.name):
            self.entities.setdefault(key, entity)
