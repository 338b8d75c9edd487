"""A model in the world: its description, its body in the engine, and its state."""

import logging
from collections.abc import Collection, Iterable, Mapping, Sequence
from math import isfinite
from typing import Any

from robot_sim.physics.description import ModelDescription, SavedMotion, Shape
from robot_sim.physics.dynamics import effective_inertias, poses_at_zero
from robot_sim.physics.engine import FASTEST, Body, Twist
from robot_sim.physics.loops import closed, in_loops
from robot_sim.physics.lumping import WORLD
from robot_sim.physics.pose import ZERO, Pose
from robot_sim.state_dict import Shared

NO_STOP = 1e16  # [rad, m]; what Gazebo calls no limit
GENTLEST = 0.5  # of the damping that would stop a joint in one step
SOFTEST = 0.25  # of inertia / step²; a stiffer spring swings faster than steps can follow
SPINNING = 0.1  # [rad] in a step: no base of a robot turns that fast by itself

logger = logging.getLogger(f"rosout.{__name__}")
AT_REST: Twist = (ZERO, ZERO)


class Model(Shared):
    """A model. Its frame is the one that it was spawned in; the root link is in it at `root_pose`."""

    def __init__(self, name: str, description: ModelDescription, body: Body, pose: Pose) -> None:
        self.name = name
        self.loads = 1  # of bodies with its description into the engine
        self.number = 0  # unique in the world, also among models that have had the same name
        self.description = description
        self.body = body
        self.initial_pose = pose
        self.placed = pose  # where it was put last: a static model stays there
        self.time_step = 0.0  # [s], the world's
        self._damped: dict[str, float] = {}  # the engine's damping [N m s/rad, N s/m] by joint
        self.springs: dict[str, float] = {}  # stiffness [N m/rad, N/m] by joint
        self.kinematic = description.links[description.root].kinematic
        decaying = [name for name, link in description.links.items() if any(link.decay or ())]
        self.decaying = [] if description.static else decaying  # links
        self.damping_added: Mapping[str, float] = {}  # [N m s/rad, N s/m] in addition to the file's
        self._motors: dict[str, tuple[float, float]] = {}  # speed [rad/s, m/s] and effort [N m, N]
        self._grip: dict[str, float] = {}  # factors of the friction of links
        self._limp: list[str] = []  # joints that follow by another law than their gears
        self._joints = {joint: index for index, joint in enumerate(body.joint_names)}

    @property
    def link_names(self) -> list[str]:
        """Names of the links that Gazebo shows: all but a massless `world`."""
        return [name for name in self.body.link_names if name != WORLD]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the movable joints, in document order."""
        return self.body.joint_names

    @property
    def all_joints(self) -> list[str]:
        """Names of all joints that Gazebo lists, fixed ones included, in document order."""
        names, place = list(self.description.joints), self.description.foot
        names[place:place] = set(self.description.world_joints) - {WORLD, *names}  # one at most
        return names

    def joint_index(self, name: str) -> int:
        """Returns the index of a movable joint in the body."""
        return self._joints[name]

    def collisions(self, link: str) -> dict[str, Shape]:
        """Returns the collision shapes of `link` by name."""
        return {shape.name: shape for shape in self.description.links[link].collisions}

    def carriers(self, link: str) -> list[str]:
        """Names of the movable joints between the root and `link`, from the root on."""
        joints = self.description.carriers(link)
        return [joint.name for joint in joints if joint.name in self._joints]

    def link_state(self, name: str) -> tuple[Pose, Twist]:
        """Returns pose and twist of the frame of link `name`, in world axes."""
        return self.body.link_state(name)

    def link_poses(self) -> list[Pose]:
        """Returns the poses of the frames of all links in `link_names`, in world axes."""
        return [pose for name, pose in self.poses_by_link().items() if name != WORLD]

    def poses_by_link(self) -> dict[str, Pose]:
        """Returns the poses of the frames of all links, in world axes."""
        return self.body.link_poses()

    def root_state(self) -> tuple[Pose, Twist]:
        """Returns pose and twist of the canonical (first) link's frame, in world axes."""
        return self.link_state(self.description.root)

    def state(self) -> tuple[Pose, Twist]:
        """Returns the model frame's pose and the twist of its canonical (first) link, in world axes."""
        pose, twist = self.link_state(self.description.root)
        return pose.compose(self.description.root_pose.inverse()), twist

    def place(self, pose: Pose, twist: Twist = AT_REST) -> None:
        """Moves the whole model rigidly to `pose`, its root link moving with `twist`; joints stay."""
        self.placed = pose
        self.body.reset_base(pose.compose(self.description.root_pose), twist)

    def begin(self, start: SavedMotion) -> None:
        """Moves as in a saved world; the initial pose stays."""
        self.place(start.pose.compose(self.description.root_pose.inverse()), start.twist)
        for name, index in self._joints.items():
            self.body.reset_joint(index, *start.joints[name])
        self.put_followers()

    def joint_state(self, name: str) -> tuple[float, float]:
        """Returns position [rad, m] and velocity [rad/s, m/s] of a joint; zeros for a fixed one."""
        if name not in self._joints and name in self.all_joints:
            return 0.0, 0.0
        state = self.body.joint_states()[self._joints[name]]
        return state[0], state[1]

    def set_joint_positions(self, positions: Mapping[str, float]) -> None:
        """Puts joints at `positions` [rad, m], clamped to their limits, at rest with all that they carry.

        Unknown names are ignored, and joints are set in order of name (docs/contract/gazebo.md 2.16).
        """
        before = self.joint_states()
        for name in sorted(set(positions) & set(self._joints)):
            joint = self.description.joints[name]
            self.body.reset_joint(self._joints[name], self.clamped(name, positions[name]))
            self._rest(below.name for below in self.description.joints_below(joint.child))
        self.put_followers()
        self.close_loops(positions, before)

    def set_joint_velocities(self, velocities: Mapping[str, float]) -> None:
        """Sets the `velocities` [rad/s, m/s] of joints; unknown names are ignored."""
        states = self.body.joint_states()
        for name in sorted(set(velocities) & set(self._joints)):
            index = self._joints[name]
            self.body.reset_joint(index, states[index][0], velocities[name])
        self.put_followers()
        self.close_loops(velocities, states)

    def put_followers(self) -> None:
        """Puts joints that follow others where those have them, within their stops."""
        for name, mimic in self.description.mimics.items():
            position, velocity = self.joint_state(mimic.driver)
            wanted = mimic.multiplier * position + mimic.offset
            self.body.reset_joint(self._joints[name], self.clamped(name, wanted), mimic.multiplier * velocity)

    def close_loops(self, held: Collection[str], before: Sequence[Sequence[float]]) -> None:
        """Puts the joints of loops so that these close, the `held` ones where they are.

        If that can't be, all joints of loops return to their states `before`, at rest.
        """
        if not self.description.loops:
            return
        states = dict(zip(self._joints, self.joint_states(), strict=True))
        old = {name: state[0] for name, state in zip(self._joints, before, strict=True)}
        starts = {name: (old[name], state[1]) for name, state in states.items()}
        goals = {name: states[name][0] for name in states if name in held}
        solution = closed(self.description, starts if goals else states, goals)
        if solution is None:
            loose = in_loops(self.description)
            solution = states | {name: (old[name], 0.0) for name in states if name in loose}
            logger.warning(
                "Model '%s': its loops don't close on the way to %s; they stay as they were",
                self.name, ", ".join(f"{name} = {goals[name]:g}" for name in sorted(goals) if name in loose),
            )  # fmt: skip
        for name, state in solution.items():
            if state != states[name]:
                self.body.reset_joint(self._joints[name], *state)

    def release_follower(self, name: str) -> None:
        """Takes the gear from a joint that follows another one."""
        self._limp.append(name)
        self.body.set_gear(name, 0.0)

    def clamped(self, name: str, position: float) -> float:
        """Returns `position` [rad, m] within the stops of joint `name`."""
        return self.description.joints[name].clamped(position)

    def set_stops(self, name: str, lower: float | None, upper: float | None) -> None:
        """Sets a joint's stops [rad, m]; None keeps one. Crossed stops don't act, as in ODE."""
        joint = self.description.joints[name]
        if not joint.bounded:
            joint.kind, joint.lower, joint.upper = "revolute", -NO_STOP, NO_STOP
        joint.lower = joint.lower if lower is None else max(-NO_STOP, min(NO_STOP, lower))
        joint.upper = joint.upper if upper is None else max(-NO_STOP, min(NO_STOP, upper))
        self.body.set_limits(self._joints[name], joint.lower, joint.upper)

    def set_motor(self, name: str, velocity: float | None, effort: float | None) -> None:
        """Sets speed [rad/s, m/s] and maximum effort [N m, N] of a joint's own motor; None keeps one.

        ODE's dry friction is such a motor at speed 0, so a new effort replaces the friction.
        """
        old = self._motors.get(name, (0.0, self.description.joints[name].friction))
        speed = old[0] if velocity is None else velocity
        most = old[1] if effort is None else effort
        self._motors[name] = (max(-FASTEST, min(FASTEST, speed)), min(most, NO_STOP))
        self.body.set_motor(self._joints[name], *self._motors[name])

    def set_friction(self, link: str, factor: float) -> None:
        """Multiplies the friction of the file for the collisions of `link` by `factor`."""
        self._grip[link] = factor
        self.body.set_friction(link, factor)

    def apply_damping(self, time_step: float) -> None:
        """Sets the joints' damping in the engine, cut where a step of `time_step` [s] couldn't follow it.

        A spring that is too stiff acts implicitly: on the position after the step, by a damping of
        stiffness · step. Where damping is explicit, its stiffness is cut. The bounds are those with all
        joints at zero, so that they don't depend on the history.
        """
        self.time_step = time_step
        joints = self.description.joints
        dampings = {name: joints[name].damping + self.damping_added.get(name, 0.0) for name in self._joints}
        sprung = {name for name in self._joints if joints[name].spring_stiffness > 0.0}
        damped = {name for name, damping in dampings.items() if damping > 0.0} | sprung
        if not damped | set(self._damped):
            return
        inertias = effective_inertias(self.description, poses_at_zero(self.description))
        for name in damped | set(self._damped):
            damping = min(dampings[name], GENTLEST * inertias[name] / time_step)
            if name in sprung:
                stiffness = joints[name].spring_stiffness
                most = SOFTEST * inertias[name] / time_step**2
                if stiffness > most:
                    stiffness = stiffness if self.body.implicit_damping else most
                    damping += time_step * stiffness
                self.springs[name] = stiffness
            self._damped[name] = damping
            self.body.set_damping(self._joints[name], self._damped[name])

    @property
    def softened(self) -> list[str]:
        """Names of joints whose springs are cut."""
        joints = self.description.joints
        return [name for name, each in self.springs.items() if each < joints[name].spring_stiffness]

    def add_damping(self, added: Mapping[str, float]) -> None:
        """Adds damping [N m s/rad, N s/m] to the file's, replacing what was added before."""
        if added != self.damping_added:
            self.damping_added = added
            self.apply_damping(self.time_step)

    def calm(self, kept: Mapping[str, float]) -> None:
        """Calms a robot that has blown up: joints keep a share of their speed.

        Joints beyond a stop are put onto it, and a free base stops spinning.
        """
        states = self.joint_states()
        for name, share in kept.items():
            position, speed = (x if isfinite(x) else 0.0 for x in states[self._joints[name]])
            self.body.reset_joint(self._joints[name], self.clamped(name, position), share * speed)
        if not self.description.fixed_base:
            pose, (linear, angular) = self.root_state()
            if not max(map(abs, angular)) * self.time_step < SPINNING:
                self.body.reset_base(pose, (linear, ZERO))

    def move_into(self, body: Body) -> None:
        """Moves its state into another body of the engine, of the same description, and uses that."""
        pose, twist = self.root_state()
        states = self.joint_states()
        body.reset_base(pose, twist)
        for index, (position, velocity) in enumerate(states):
            body.reset_joint(index, position, velocity)
        self.go_on_in(body)
        self.loads += 1

    def go_on_in(self, body: Body) -> None:
        """Uses another body of the engine, which is in the same state already."""
        self.body = body
        for name, motor in self._motors.items():
            body.set_motor(self._joints[name], *motor)
        for name, damping in self._damped.items():
            body.set_damping(self._joints[name], damping)
        for link, factor in self._grip.items():
            body.set_friction(link, factor)
        for name in self._limp:
            body.set_gear(name, 0.0)

    def properties(self) -> tuple[object, ...]:
        """Returns what services change of it, which a snapshot of the world doesn't bring back."""
        links = {} if self.description.static else self.description.links
        joints = self.description.joints
        return (
            tuple([(link.inertia, link.gravity) for link in links.values()]),
            tuple([(each.kind, each.lower, each.upper, each.damping) for each in joints.values()]),
            {link: factor for link, factor in self._grip.items() if factor != 1.0},
        )

    def state_dict(self) -> dict[str, Any]:
        """Returns where it is, how it moves, and its motors; from now on it moves as after a load."""
        motion = self.body.motion()
        self.body.move(motion)
        return {
            "motion": motion, "motors": self._motors.copy(), "placed": self.placed, "loads": self.loads,
            "properties": self.properties(),
        }  # fmt: skip

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Takes back what `state_dict` has returned; the properties are the same."""
        self.body.move(state["motion"])
        self.placed = state["placed"]
        motors = state["motors"]
        for name in self._motors.keys() | motors.keys():
            unset = (0.0, self.description.joints[name].friction)
            motor = motors.get(name, unset)
            if motor != self._motors.get(name, unset):
                self.body.set_motor(self._joints[name], *motor)
        self._motors = dict(motors)

    def joint_states(self) -> list[tuple[float, float]]:
        """Returns position [rad, m] and velocity [rad/s, m/s] of each movable joint."""
        return [(state[0], state[1]) for state in self.body.joint_states()]

    def rest_joints(self) -> None:
        """Stops all joints; the root link keeps its velocity."""
        self._rest(self._joints)

    def reset(self, joints: bool) -> None:
        """Returns to the initial pose, at rest; with `joints`, also every joint to zero."""
        if joints:
            for index in self._joints.values():
                self.body.reset_joint(index, 0.0)
            self.put_followers()
            self.close_loops((), [(0.0, 0.0)] * len(self._joints))
        self.place(self.initial_pose)
        self.rest_joints()

    def _rest(self, names: Iterable[str]) -> None:
        states = self.body.joint_states()
        for index in (self._joints[name] for name in names if name in self._joints):
            self.body.reset_joint(index, states[index][0])
