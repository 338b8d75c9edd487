"""Fingerprints of worlds: what has to be the same where a snapshot is restored."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import PurePath
from typing import Any
from xml.etree.ElementTree import Element

from robot_sim.physics.description import Joint, Link, Mesh, ModelDescription, Shape
from robot_sim.physics.world import World
from robot_sim.robot import ControlledRobot

# What has no effect on motion, or is compared by itself (`Model.properties`).
LEFT_OUT: Mapping[type, frozenset[str]] = {
    ModelDescription: frozenset(("warnings", "left_out", "stand_ins", "script", "initial_pose")),
    Link: frozenset(("inertia", "gravity")),
    Joint: frozenset(("kind", "lower", "upper", "damping")),
}


def fingerprint(world: World, robots: Sequence[ControlledRobot]) -> dict[str, Any]:
    """Returns what snapshots of a world fit, as plain data.

    Controllers that claim no joint, such as those that publish, may differ. So may planes: a world without
    ROS has none where nothing reaches them.
    """
    return {
        "engine": type(world.engine).__name__.removesuffix("Engine"),
        "models": {
            name: _digest((model.description, model.initial_pose))
            for name, model in world.models.items()
            if not model.description.is_plane
        },
        "robots": [
            {
                "model": robot.model.name,
                "controllers": {
                    each.name: type(each).__name__
                    for each in robot.manager.running
                    if any(each.claims.values())
                },
            }
            for robot in robots
        ],
    }


def misfits(given: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    """Returns in what a world differs from that of a snapshot; "" if it fits.

    Args:
        given: fingerprint of the snapshot.
        here: fingerprint of the world.
    """
    if given.get("engine") != here["engine"]:
        return f"the snapshot is of the engine {given.get('engine')}, and here is {here['engine']}"
    models, own = given.get("models"), here["models"]
    if not isinstance(models, dict) or set(models) != set(own):
        there = sorted(map(str, models)) if isinstance(models, dict) else "?"
        return f"the snapshot has the models {there}, and here are {sorted(own)}"
    if others := [name for name in own if models[name] != own[name]]:
        return (
            f"the model '{others[0]}' has another description or initial pose than in the snapshot"
        )
    if given.get("robots") != here["robots"]:
        return (
            "the controllers that run aren't those of the snapshot: "
            f"{given.get('robots')!s:.200} in it, and here {here['robots']!s:.200}"
        )
    return ""


def _digest(value: Any) -> str:
    return hashlib.blake2b(repr(_plain(value)).encode(), digest_size=16).hexdigest()


def _plain(value: Any) -> Any:
    if isinstance(value, Mesh):
        return value.digest
    if isinstance(value, Element):
        text = (value.text or "").strip()
        return value.tag, sorted(value.attrib.items()), text, [_plain(each) for each in value]
    if is_dataclass(value):
        left = LEFT_OUT.get(type(value), frozenset())
        entries = {f.name: getattr(value, f.name) for f in fields(value) if f.name not in left}
        if isinstance(value, Shape):  # its file may be in another folder
            entries["mesh"] = PurePath(value.mesh).name
        return [_plain(each) for each in entries.values()]
    if isinstance(value, Mapping):
        return [(key, _plain(each)) for key, each in value.items()]
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return value
