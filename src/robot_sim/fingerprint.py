"""Fingerprints of worlds: whether a snapshot fits."""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, fields, is_dataclass
from pathlib import PurePath
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from robot_sim.applied_forces import ActingTime
from robot_sim.control.controllers.base import Controller
from robot_sim.control.joint import JointHandle
from robot_sim.control.pid import Pid
from robot_sim.grippers import PidFollower
from robot_sim.physics.description import Joint, Link, Mesh, ModelDescription, Shape, suns
from robot_sim.physics.model import NO_STOP
from robot_sim.physics.pose import ZERO, Pose, rotate
from robot_sim.physics.world import World
from robot_sim.plain_data import LARGEST, differences, entries_of, is_within, misfit
from robot_sim.robot import ControlledRobot
from robot_sim.snapshot import SnapshotError
from robot_sim.state_dict import Shared, Stateful, is_supplied

# What has no effect on motion, or is compared by itself (`Model.properties`).
LEFT_OUT: Mapping[type, frozenset[str]] = {
    ModelDescription: frozenset(("warnings", "left_out", "stand_ins", "initial_pose")),
    Link: frozenset(("inertia", "gravity")),
    Joint: frozenset(("kind", "lower", "upper", "damping")),
}
SETTINGS = ("options", "_settings", "_geometry")  # of supplied controllers
OFF_LENGTH = 1e-3  # of a unit quaternion


def fingerprint(
    world: World, robots: Sequence[ControlledRobot], followers: Mapping[str, PidFollower]
) -> dict[str, Any]:
    """Returns what snapshots of a world fit, as plain data.

    Controllers that claim no joint, such as those that publish, may differ. Planes may be missing: a world
    without ROS has none where nothing reaches them.
    """
    planes = {name for name, model in world.models.items() if model.description.is_plane}
    digests = {name: digest((each.description, each.initial_pose)) for name, each in world.models.items()}
    lights = suns(world.lights.values())
    return {
        "lights": digest([(each.diffuse, rotate(each.pose.orientation, each.direction)) for each in lights]),
        "engine": type(world.engine).__name__.removesuffix("Engine"),
        "models": {name: each for name, each in digests.items() if name not in planes},
        "planes": {name: each for name, each in digests.items() if name in planes},
        "robots": [
            {
                "model": robot.model.name,
                "controllers": {
                    each.name: _controller(each)
                    for each in robot.manager.running
                    if any(each.claims.values())
                },
                "gains": _configured(robot.hardware.pids),
                "limits": digest({name: each.limits for name, each in robot.hardware.joints.items()}),
            }
            for robot in robots
        ],
        "followers": _configured({name: each.pid for name, each in followers.items()}),
    }


def _configured(pids: Mapping[str, Pid]) -> dict[str, tuple[float, ...]]:
    return {name: astuple(pid.configured) for name, pid in pids.items()}


def _controller(controller: Controller) -> dict[str, Any]:
    """Returns its class, joints, settings and configured gains, which a snapshot doesn't bring back."""
    # A user's may change its lists; what they refer to is compared when they are loaded.
    own = vars(controller) if is_supplied(type(controller)) else {}
    entries = [each for some in own.values() if isinstance(some, list) for each in some]
    handles = [getattr(each, "joint", each) for each in entries]
    return {
        "type": type(controller).__name__,
        "claims": dict(controller.claims),
        "joints": [each.name for each in handles if isinstance(each, JointHandle)],
        "gains": _configured(controller.pids),
        "settings": digest([own.get(name) for name in SETTINGS]),
    }


def misfits(given: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    """Returns in what a world differs from that of a snapshot; "" if it fits.

    Args:
        given: Fingerprint of the snapshot.
        here: Fingerprint of the world.
    """
    if given.get("engine") != here["engine"]:
        return f"the snapshot is of the engine {given.get('engine')!r:.50}, and here is {here['engine']!r}"
    models, own = given.get("models"), here["models"]
    if not isinstance(models, dict) or set(models) != set(own):
        there = sorted(map(str, models)) if isinstance(models, dict) else models
        return f"the snapshot has the models {there!r:.300}, and here are {sorted(own)}"
    others = [name for name in own if models[name] != own[name]]
    planes = given["planes"] if isinstance(given.get("planes"), dict) else {}
    others += [name for name, digest in here["planes"].items() if planes.get(name, digest) != digest]
    if others:
        return f"the model '{others[0]}' has another description or initial pose than in the snapshot"
    if given.get("lights") != here["lights"]:
        return "the world's lights aren't those of the snapshot"
    one, other = ({name: fits.get(name) for name in ("robots", "followers")} for fits in (given, here))
    found = next(differences(one, other), "")
    return found and f"controllers, gains or limits aren't those of the snapshot: {found}"


def check_foreign(
    robots: Sequence[ControlledRobot], parts: Mapping[str, Any], before: Any, state: Any
) -> None:
    """Checks that a state of unknown origin can take the place of the present one.

    Values of controllers and plugins may still be wrong: then these fail, and nothing else.

    Raises:
        SnapshotError: If something is of another type, or a tick would fail.
    """
    pairs = zip(robots, before["robots"], state["robots"], strict=True)
    supplied = {name for name, part in parts.items() if is_supplied(type(part)) and name != "readers"}
    own_parts = {name: each for name, each in before["parts"].items() if name in supplied}
    known = {**before, "robots": [_known(*each) for each in pairs], "parts": own_parts}
    if fault := misfit(known, state):
        raise SnapshotError(fault)
    applied, world, always = state["applied"], state["world"], ActingTime(0, -1)
    examples = (
        (("", "", 0.0, always), applied["efforts"]), (("", "", (ZERO, ZERO), always), applied["wrenches"]),
        ((("", ""), ("", ""), Pose(), 0), world["attachments"]), (Pose(), world["fastened"].values()),
    )  # fmt: skip
    faults = [misfit(example, each, "world", exactly=True) for example, some in examples for each in some]
    faults += [] if 0 <= state["now"] < LARGEST // 2 else [f"its time is {state['now']}"]
    physics = [state["world"], state["applied"], [each["efforts"] for each in state["robots"]]]
    if not is_within(physics, NO_STOP):
        faults.append("positions, velocities, forces or efforts are too large, or NaN")
    turns = [each.orientation for each in entries_of(physics) if isinstance(each, Pose)]
    if not all(abs(math.hypot(*turn) - 1.0) < OFF_LENGTH for turn in turns):  # PyBullet wouldn't recover
        faults.append("an orientation's length isn't 1")
    there = set(state["world"]["models"])
    faults += [f"it lacks '{each}'" for each in state["world"]["order"] if each not in there]
    for robot, one, other in zip(robots, before["robots"], state["robots"], strict=True):
        faults.append(misfit(0, other["waited"] or 0, "waited"))
        own, given = (_needed(each, _claiming(robot)) for each in (one, other))
        faults.append(misfit(own, given, robot.model.name, exactly=True))
        absent, others = ([*_absent([each["hardware"], each["efforts"]])] for each in (one, other))
        if not faults[-1] and absent != others:
            faults.append(f"numbers of {robot.model.name}'s joints are missing")
    for name, part in parts.items():
        if name in state["parts"] and name in supplied and isinstance(part, (Shared, Stateful)):
            own, given = (dict.fromkeys(each["parts"][name]) for each in (before, state))
            faults.append(misfit(own, given, name, exactly=True))
    if found := next(filter(None, faults), ""):
        raise SnapshotError(found)


def _known(robot: ControlledRobot, own: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a robot's state without users' controllers, and publishing ones that the other lacks."""
    claiming = _claiming(robot)
    manager, there = own["manager"], given["manager"]["controllers"]
    kept = {
        name: each
        for name, each in manager["controllers"].items()
        if is_supplied(type(robot.manager.get(name))) and (name in claiming or name in there)
    }
    for name, each in kept.items():
        if name in there and isinstance(each, dict) and set(each) != set(there[name]):
            raise SnapshotError(f"{name} has {list(there[name])!s:.200}, not {list(each)!s:.200}")
    return {**own, "manager": {**manager, "controllers": kept}}


def _claiming(robot: ControlledRobot) -> set[str]:
    return {each.name for each in robot.manager.running if any(each.claims.values())}


def _needed(robot: Mapping[str, Any], running: set[str]) -> dict[str, Any]:
    """Returns of a robot's state what a tick can't do without."""
    own = [(name, each) for name, each in robot["manager"]["controllers"].items() if name in running]
    loops = {name: each.get("pids") for name, each in own if isinstance(each, dict)}
    pids = {name: own for name, own in loops.items() if own}
    return {"hardware": robot["hardware"], "efforts": robot["efforts"], "pids": pids}


def _absent(value: Any, place: str = "") -> Iterator[str]:
    """Yields the places of None, apart from limiters' last commands, which begin with it."""
    if isinstance(value, (list, tuple)):
        value = dict(enumerate(value))
    for name, each in value.items() if isinstance(value, dict) else ():
        if each is None and name != "_last":
            yield f"{place}/{name}"
        yield from _absent(each, f"{place}/{name}")


def digest(value: Any) -> str:
    """Returns what tells descriptions apart: data classes, containers, numbers and texts."""
    return hashlib.blake2b(repr(_plain(value)).encode(), digest_size=16).hexdigest()


def _plain(value: Any) -> Any:
    if isinstance(value, Mesh):
        return value.digest
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, (int, float, np.number)):
        return float(value) + 0.0  # -0.0 is 0.0
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
