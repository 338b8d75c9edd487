"""Mimic PIDs, vacuum grippers and grasp fixing, without ROS.

A PID for a joint that follows another one, suction, and a hold on what opposing fingers press on.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple

from robot_sim.control.hardware import drive_pid
from robot_sim.control.limits import clamp
from robot_sim.control.pid import Pid
from robot_sim.physics.engine import Twist
from robot_sim.physics.model import Model
from robot_sim.physics.pose import ZERO, Pose, Vector, add, scale, subtract
from robot_sim.physics.world import Attachment, World
from robot_sim.state_dict import Stateful

REACH = 0.05  # [m] from the suction's origin to that of a link: it is pulled
TOUCH = 0.01  # [m]: it is held
MOST_PULL = 20.0  # [N]


class PidFollower(Stateful):
    """Moves a joint that follows another one by a PID, instead of by a gear.

    Call `update` in each tick, and `moved` after something other than time has moved the model.
    """

    non_persistent = ("_mimic",)

    def __init__(self, model: Model, joint: str, pid: Pid) -> None:
        self._model, self._joint, self.pid = model, joint, pid
        self._mimic = model.description.mimics[joint]
        model.release_follower(joint)

    def moved(self) -> None:
        """Forgets the past."""
        self.pid.clear()

    def update(self, now: int) -> None:
        """Applies the effort of the step that ends at `now` [ns]."""
        mimic, model = self._mimic, self._model
        target = mimic.multiplier * model.joint_state(mimic.driver)[0] + mimic.offset
        error = target - model.joint_state(self._joint)[0]
        if abs(error) >= mimic.sensitiveness:
            effort = self.pid.compute(error, model.time_step)
            index = model.joint_index(self._joint)
            model.body.add_effort(index, clamp(effort, -mimic.effort, mimic.effort))


def pid_followers(model: Model, gains: Mapping[str, object]) -> Iterator[PidFollower]:
    """Yields the joints that follow by a PID; those without `gains`, by joint, keep their gears."""
    for name, mimic in model.description.mimics.items():
        pid = drive_pid(gains, name) if mimic.pid == "" else None
        if pid is not None:
            yield PidFollower(model, name, pid)


class Suction(Stateful):
    """Pulls links of other models to a link, and holds those that have come to it."""

    def __init__(self, world: World, model: Model, link: str) -> None:
        self.on = False
        self._world, self._model, self._link = world, model, link
        self._held: list[Attachment] = []
        self._near = False  # whether something was within reach in the last tick

    def update(self, now: int) -> None:
        """Pulls, or lets go; called in each tick."""
        self._held = [each for each in self._held if each in self._world.attachments]
        if not self.on:
            self.release()
            return
        self._near = False
        own = self._model.link_state(self._link)
        for model in list(self._world.models.values()):
            if model is self._model or model.description.static or model.description.script:
                continue
            for link in model.link_names:
                if not any(each.second == (model, link) for each in self._held):
                    self._pull(model, link, *own)

    def state_dict(self) -> dict[str, Any]:
        return {"on": self.on, "near": self._near, "held": [each.number for each in self._held]}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        self.on, self._near = state["on"], state["near"]
        there = {each.number: each for each in self._world.attachments}
        self._held = [there[number] for number in state["held"] if number in there]

    def holds(self) -> bool:
        """Returns whether something is near enough to be pulled or held."""
        return self.on and (bool(self._held) or self._near)

    def release(self) -> None:
        """Lets go of what it holds."""
        for each in self._held:
            self._world.detach(each)
        self._held, self._near = [], False

    def _pull(self, model: Model, link: str, own: Pose, twist: Twist) -> None:
        pose, _ = model.link_state(link)
        way = subtract(own.position, pose.position)
        distance = math.hypot(*way)
        if distance >= REACH:
            return
        self._near = True
        is_root = link == model.description.root
        if distance < TOUCH:
            if is_root:
                model.body.reset_base(Pose(own.position, pose.orientation), twist)
            self._held.append(self._world.attach((self._model, self._link), (model, link)))
            return
        if is_root:
            model.body.set_base_twist(twist)
        pull = min(1.0 / distance, MOST_PULL) / distance
        model.body.add_wrench(link, scale(way, pull), ZERO)


class GripRule(NamedTuple):
    """When a `GraspHold` takes and releases an object."""

    angle: float  # [rad]; the least one between two forces that oppose each other
    threshold: int  # looks that found it gripped, less those that didn't; above, it is taken
    most: int  # up to which they are counted
    release: float  # [m] that a finger may move, seen from the object


class GraspHold(Stateful):
    """Fixes an object to the palm while fingers press on it from opposing sides."""

    def __init__(self, world: World, model: Model, palm: str, fingers: Sequence[str], rule: GripRule) -> None:
        self._world, self._model, self._palm = world, model, palm
        self._fingers, self._rule = tuple(fingers), rule
        self._counts: dict[tuple[Model, str], int] = {}
        self._held: dict[tuple[Model, str], tuple[Attachment, dict[str, Pose]]] = {}

    def state_dict(self) -> dict[str, Any]:
        return {
            "counts": [(model.name, link, count) for (model, link), count in self._counts.items()],
            "held": [
                (model.name, link, made.number, dict(places))
                for (model, link), (made, places) in self._held.items()
            ],
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        models = self._world.models
        self._counts = {(models[name], link): count for name, link, count in state["counts"]}
        there = {each.number: each for each in self._world.attachments}
        self._held = {
            (models[name], link): (there[number], dict(places))
            for name, link, number, places in state["held"]
            if number in there
        }

    def forget(self) -> None:
        """Forgets all contacts counted so far."""
        self._counts.clear()

    def look(self, now: int) -> None:
        """Looks at the contacts of the last step; called at its rate."""
        self._held = {key: held for key, held in self._held.items() if held[0] in self._world.attachments}
        for key in [key for key, (_, places) in self._held.items() if self._opened(key, places)]:
            self._world.detach(self._held.pop(key)[0])
            self._counts.pop(key, None)
        forces = self._forces()
        for key in {*forces, *self._counts} - set(self._held):
            pairs = combinations(forces.get(key, {}).values(), 2)
            gripped = any(_angle(a, b) >= self._rule.angle for a, b in pairs)
            count = self._counts.get(key, 0) + (1 if gripped else -1)
            self._counts[key] = max(0, min(self._rule.most, count))
            if gripped and count > self._rule.threshold:
                made = self._world.attach((self._model, self._palm), key)
                self._held[key] = made, self._places(key, forces[key])
        self._counts = {key: count for key, count in self._counts.items() if count}

    def _forces(self) -> dict[tuple[Model, str], dict[str, Vector]]:
        """Returns the normal force [N] of each finger on each link of another model that it touches."""
        models = {id(model.body): model for model in self._world.models.values()}
        found: dict[tuple[Model, str], dict[str, Vector]] = {}
        for contact in self._world.contacts():
            first, second, sign = contact.first, contact.second, -1.0
            if second.body is self._model.body:
                first, second, sign = second, first, 1.0
            if first.body is not self._model.body or first.link not in self._fingers:
                continue
            other = models[id(second.body)]
            if other is not self._model and not other.description.static:
                on_it = found.setdefault((other, second.link), {})
                force = scale(contact.force, sign)
                on_it[first.link] = add(on_it.get(first.link, ZERO), force)
        return found

    def _places(self, key: tuple[Model, str], fingers: Mapping[str, Vector]) -> dict[str, Pose]:
        """Returns where fingers are, seen from an object."""
        frame = key[0].link_state(key[1])[0]
        return {each: self._model.link_state(each)[0].relative_to(frame) for each in fingers}

    def _opened(self, key: tuple[Model, str], places: dict[str, Pose]) -> bool:
        """Returns whether a finger that has gripped an object has moved away from its place."""
        now = self._places(key, dict.fromkeys(places, ZERO))
        gaps = [math.dist(now[each].position, pose.position) for each, pose in places.items()]
        return max(gaps) > self._rule.release


def _angle(a: Vector, b: Vector) -> float:
    """Returns the angle between two vectors [rad]; 0 if one has no length."""
    lengths = math.hypot(*a) * math.hypot(*b)
    if lengths == 0.0:
        return 0.0
    cosine = sum(x * y for x, y in zip(a, b, strict=True)) / lengths
    return math.acos(clamp(cosine, -1.0, 1.0))
