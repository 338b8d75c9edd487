"""Names that a client gives to things of a world: plain, or scoped as model::link; wrong ones are refused."""

from collections.abc import Iterable
from difflib import get_close_matches

from bullet_gazebo.physics.mechanics.lumping import WORLD
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.world import World

SCOPE = "::"
MOST_COMPARED = 2000  # names; in a fuller world the search for a near one would hold everybody


class UnknownName(ValueError):
    """A name that nothing has, or several have; the text says what to write instead."""


def find_model(world: World, name: str) -> Model:
    """Returns the model of that name.

    Raises:
        UnknownName: if there is none.
    """
    if name not in world.models:
        raise UnknownName(f"there is no model '{name}'{did_you_mean(name, world.models)}")
    return world.models[name]


def find_link(world: World, name: str) -> tuple[Model, str]:
    """Returns model and plain name of a link; also of one that a fixed joint has made part of another one.

    Args:
        world: where it is.
        name: of the link, or model::link, which it must be where several models have such a link.

    Raises:
        UnknownName: if there is none, or there are several.
    """
    scope, _, plain = name.rpartition(SCOPE)
    if scope:
        models = [world.models[scope]] if scope in world.models else []
    else:
        models = list(world.models.values())
    found = [model for model in models if _has_link(model, plain)]
    if not found:
        raise UnknownName(f"there is no link '{name}'{did_you_mean(name, link_names(world))}")
    if len(found) > 1:
        raise UnknownName(f"several models have a link '{name}'; write model::{name}")
    return found[0], plain


def link_names(world: World) -> list[str]:
    """All names that `find_link` knows, plain and scoped."""
    names = []
    for model in world.models.values():
        description = model.description
        for link in (*description.links, *description.lumped):
            if link != WORLD:
                names += [link, f"{model.name}{SCOPE}{link}"]
    return names


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of a line that refuses a name: the nearest one of those that are known, if one is near."""
    names = sorted(set(known))
    near = get_close_matches(name, names, 1) if len(names) <= MOST_COMPARED else []
    return f"; did you mean '{near[0]}'?" if near else ""


def _has_link(model: Model, name: str) -> bool:
    description = model.description
    return name != WORLD and (name in description.links or name in description.lumped)
