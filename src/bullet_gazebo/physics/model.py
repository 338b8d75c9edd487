"""A model in the world: a description, a body in the engine, and where it stands."""

from collections.abc import Mapping

from bullet_gazebo.physics.description import ModelDescription
from bullet_gazebo.physics.engine import Body, Twist
from bullet_gazebo.physics.pose import ZERO, Pose
from bullet_gazebo.physics.urdf import WORLD

AT_REST: Twist = (ZERO, ZERO)


class Model:
    """One model. Its frame is the one it was spawned in; the root link stands in it at `root_pose`."""

    def __init__(self, name: str, description: ModelDescription, body: Body, pose: Pose) -> None:
        self.name = name
        self.description = description
        self.body = body
        self.initial_pose = pose
        self._joints = {joint: index for index, joint in enumerate(body.joint_names)}

    @property
    def link_names(self) -> list[str]:
        """Names of the links that Gazebo would show: all but a massless `world`."""
        return [name for name in self.body.link_names if name != WORLD]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the movable joints, in document order."""
        return self.body.joint_names

    def link_state(self, name: str) -> tuple[Pose, Twist]:
        """Returns pose and twist of the frame of link `name`, in world axes."""
        return self.body.link_state(name)

    def state(self) -> tuple[Pose, Twist]:
        """Returns the model frame's pose and the twist of its canonical (first) link, in world axes."""
        pose, twist = self.body.link_state(self.description.root)
        return pose.compose(self.description.root_pose.inverse()), twist

    def place(self, pose: Pose, twist: Twist = AT_REST) -> None:
        """Moves the whole model rigidly to `pose`, its root link moving with `twist`; joints stay."""
        self.body.reset_base(pose.compose(self.description.root_pose), twist)

    def joint_state(self, name: str) -> tuple[float, float]:
        """Returns position [rad, m] and velocity [rad/s, m/s] of a joint; KeyError if there is none."""
        state = self.body.joint_states()[self._joints[name]]
        return state[0], state[1]

    def set_joint_positions(self, positions: Mapping[str, float]) -> None:
        """Puts joints at `positions` [rad, m], clamped to their limits, at rest with all they carry.

        Unknown names are ignored and joints are taken in order of name (gazebo_api.md section 2.16).
        """
        for name in sorted(set(positions) & set(self._joints)):
            joint = self.description.joints[name]
            position = positions[name]
            if joint.bounded:
                position = max(joint.lower, min(joint.upper, position))
            self.body.reset_joint(self._joints[name], position)
            self._rest(self._below(joint.child))

    def rest(self) -> None:
        """Takes all velocity out of the model; poses and joint positions stay."""
        pose, _ = self.body.link_state(self.description.root)
        self.body.reset_base(pose)
        self._rest(list(self._joints))

    def reset(self, joints: bool) -> None:
        """Returns to the initial pose, at rest; with `joints`, also every joint to zero."""
        if joints:
            for index in self._joints.values():
                self.body.reset_joint(index, 0.0)
        self.place(self.initial_pose)
        self._rest(list(self._joints))

    def _rest(self, names: list[str]) -> None:
        states = self.body.joint_states()
        for name in names:
            index = self._joints[name]
            self.body.reset_joint(index, states[index][0])

    def _below(self, link: str) -> list[str]:
        """Names of the joints on the child side of `link`."""
        below = [j for j in self.description.joints.values() if j.parent == link]
        return [name for joint in below for name in (joint.name, *self._below(joint.child))]
