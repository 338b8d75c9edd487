"""Forces: what a joint transmits, and what moves a link (docs/contract/sensors.md 6e, 11.5).

They follow from how the momentum of links changes in a step, from their weight, and from what touches or
pushes them. So both engines' are the same, with what stops, motors and friction of a joint bear.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from robot_sim.applied_forces import Wrench
from robot_sim.constants import NANOSECONDS
from robot_sim.control.hardware import FORCE_TORQUE
from robot_sim.physics.description import DescriptionError, Inertia, Joint, ModelDescription
from robot_sim.physics.dynamics import tensor_in
from robot_sim.physics.loops import in_loops
from robot_sim.physics.lumping import WORLD
from robot_sim.physics.model import Model
from robot_sim.physics.passive_forces import decay_wrench
from robot_sim.physics.pose import ZERO, Vector, add, conjugate, cross, rotate, scale, subtract
from robot_sim.sensors.sensing import Measurement, Mount, sensor_of
from robot_sim.simulator import Simulator
from robot_sim.state_dict import Stateful

NOTHING: Wrench = (ZERO, ZERO)


class _Look(NamedTuple):
    """Momentum of the links at a time [ns], and what clients apply in the step that follows."""

    now: int
    momentum: Wrench
    applied: Wrench
    effort: float


class LinkForces(Stateful):
    """Force and torque on links of a model in the last step; torques are about the world's origin.

    `look` has to be called in each tick, before its physics step. The effort on `joint` is noted, too.
    """

    def __init__(self, sim: Simulator, model: Model, links: Sequence[str], joint: str = "") -> None:
        self._sim = sim
        self._model = model
        self._links = links
        self._joint = joint
        self._moves = 0
        self._last: _Look | None = None
        self.net: Wrench | None = None  # all that acts; None if it isn't known
        self.known: Wrench = NOTHING  # weight, contacts, and what clients apply
        self.effort = 0.0  # that clients apply to `joint`

    def look(self, now: int, moves: int) -> None:
        """Records the state at a tick's time [ns].

        `moves` counts what has moved bodies besides time: no force is known across such a move.
        """
        last, self.net = self._last, None
        if moves != self._moves:  # the next tick sees the same state
            self._moves, self._last = moves, None
            return
        applied, inertias = self._sim.applied, self._inertias()
        pushes = [
            _moved(centre, wrench)
            for link, (_, centre) in inertias.items()
            for wrench in (applied.wrench_on(self._model, link, now), decay_wrench(self._model, link))
        ]
        momentum = _sum(self._momentum(link, *each) for link, each in inertias.items())
        effort = applied.effort_on(self._model, self._joint, now)
        self._last = _Look(now, momentum, _sum(pushes), effort)
        time_step = self._sim.world.time_step
        if last is None or now - last.now != round(time_step * NANOSECONDS):
            return
        change = _sum([momentum, _times(last.momentum, -1.0)])
        self.net = _times(change, 1.0 / time_step)
        weights = [self._weight(link, *each) for link, each in inertias.items()]
        self.known = _sum([last.applied, *weights, *self._contacts()])
        self.effort = last.effort

    def about_centre(self, link: str) -> Wrench | None:
        """Returns the total wrench, with the torque about a link's centre of mass; None if unknown."""
        if self.net is None or link not in (inertias := self._inertias()):
            return self.net
        return _moved(scale(inertias[link][1], -1.0), self.net)

    def _inertias(self) -> dict[str, tuple[Inertia, Vector]]:
        """Returns inertias of the links, and their centres of mass in the world [m]."""
        links = self._model.description.links
        return {
            link: (inertia, self._model.link_state(link)[0].compose(inertia.com).position)
            for link in self._links
            if (inertia := links[link].inertia) is not None
        }

    def _momentum(self, link: str, inertia: Inertia, centre: Vector) -> Wrench:
        pose, (linear, angular) = self._model.link_state(link)
        velocity = add(linear, cross(angular, subtract(centre, pose.position)))
        x, y, z = (tensor_in(inertia, pose.orientation) @ angular).tolist()
        return _moved(centre, (scale(velocity, inertia.mass), (x, y, z)))

    def _weight(self, link: str, inertia: Inertia, centre: Vector) -> Wrench:
        mass = inertia.mass if self._model.description.links[link].weighs else 0.0
        return _moved(centre, (scale(self._sim.world.gravity, mass), ZERO))

    def _contacts(self) -> list[Wrench]:
        return [
            _moved(contact.point, (scale(add(contact.force, contact.friction), sign), ZERO))
            for contact in self._sim.world.contacts()
            for side, sign in ((contact.first, 1.0), (contact.second, -1.0))
            if side.body is self._model.body and side.link in self._links
        ]


class JointForces(Stateful):
    """What the child of a joint exerts on the parent, without the effort that drives a movable joint.

    Raises DescriptionError if the model doesn't have it.
    """

    non_persistent = ("_joint",)

    def __init__(self, sim: Simulator, model: Model, name: str) -> None:
        self._sim = sim
        self._model = model
        self._joint = joint = _joint(model.description, name)
        if name in in_loops(model.description):
            raise DescriptionError(
                f"joint '{name}' is part of a closed loop: its share of the force isn't known"
            )
        self.link = joint.child
        below = model.description.joints_below(joint.child)
        links = [joint.child, *(each.child for each in below)]
        self._forces = LinkForces(sim, model, links, name)

    def look(self, now: int, moves: int) -> None:
        """See `LinkForces`."""
        self._forces.look(now, moves)

    def wrench(self) -> Wrench | None:
        """Returns force [N] and torque [N m] about the joint in the last step, in the child's axes.

        None if they aren't known.
        """
        forces, joint = self._forces, self._joint
        if forces.net is None:
            return None
        pose = self._model.link_state(self.link)[0]
        frame = pose.compose(joint.anchor)
        force, torque = _sum([forces.known, _times(forces.net, -1.0)])
        torque = subtract(torque, cross(frame.position, force))
        if joint.movable:
            robots = [robot for robot in self._sim.robots if robot.model is self._model]
            effort = forces.effort + sum(robot.effort_on(joint.name) for robot in robots)
            driven = scale(rotate(frame.orientation, joint.axis), effort)
            if joint.kind == "prismatic":
                force = add(force, driven)
            else:
                torque = add(torque, driven)
        back = conjugate(pose.orientation)
        return rotate(back, force), rotate(back, torque)


class ForceTorqueSensor(Measurement):
    """A sensor of type force_torque: see `JointForces`. It measures in each step."""

    kinds = ("force_torque",)
    interface = FORCE_TORQUE

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        self._joint = JointForces(mount.sim, mount.model, sensor_of(mount, self.kinds).joint)

    def measure(self, now: int) -> Wrench | None:
        """Returns force [N] and torque [N m] in the last step; none after a move, None if not known."""
        moves, moved_at = self.mount.sensing.schedule.last_move(self.mount.model)
        self._joint.look(now, moves)
        return NOTHING if now == moved_at else self._joint.wrench()


def _joint(description: ModelDescription, name: str) -> Joint:
    if name in description.joints:
        return description.joints[name]
    if name in description.world_joints:
        return Joint(name, "fixed", WORLD, description.root)
    raise DescriptionError(
        f"the model has no joint '{name}'; a fixed one of a URDF needs <disableFixedJointLumping>"
    )


def _moved(point: Vector, wrench: Wrench) -> Wrench:
    """Returns a wrench at a point with its torque about the origin; or a momentum."""
    return wrench[0], add(wrench[1], cross(point, wrench[0]))


def _times(wrench: Wrench, factor: float) -> Wrench:
    return scale(wrench[0], factor), scale(wrench[1], factor)


def _sum(wrenches: Iterable[Wrench]) -> Wrench:
    force, torque = ZERO, ZERO
    for each in wrenches:
        force, torque = add(force, each[0]), add(torque, each[1])
    return force, torque


SENSORS = (ForceTorqueSensor,)
