"""A robot's hardware as ros_control sees it: joints by interface, and what becomes of their commands."""

from collections.abc import Iterable, Mapping

from bullet_gazebo.control.description import RobotDescription
from bullet_gazebo.control.drives import Drive, PositionDrive, VelocityDrive
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.limits import Enforcer, effort_enforcer
from bullet_gazebo.control.pid import Loop, Pid

EFFORT = "EffortJointInterface"
POSITION = "PositionJointInterface"
VELOCITY = "VelocityJointInterface"
STATE = "JointStateInterface"
GAINS = "gazebo_ros_control/pid_gains"  # where, in the robot's namespace, gains of drives stand


class RobotHardware:
    """The joints that have a transmission (docs/contract/gazebo_ros_control.md 6.3 and 6.4).

    `joints` is in alphabetical order, the order of joint states. `effort_joints` take their command
    for an effort, once their `enforcers` have clipped it; `drives` are the others.
    """

    def __init__(
        self, description: RobotDescription, gains: Mapping[str, object] | None = None
    ) -> None:
        """`gains` is the parameter tree `<ns>/gazebo_ros_control/pid_gains`: joints by name.

        Raises:
            ControlError: if a transmission's joint isn't in the description, or gains are wrong.
        """
        self.interfaces: dict[str, dict[str, JointHandle]] = {}
        for transmission in description.transmissions:
            joint = description.joints.get(transmission.joint)
            if joint is None:
                raise ControlError(f"transmission of joint '{transmission.joint}': no such joint")
            self.interfaces.setdefault(transmission.interface, {})[joint.name] = joint
        found = {name: j for group in self.interfaces.values() for name, j in group.items()}
        self.joints = {name: found[name] for name in sorted(found)}
        self.effort_joints = self._of(EFFORT)
        self.drives = self._drives(gains or {})
        self.halted = False
        self.enforcers: list[tuple[JointHandle, Enforcer]] = [
            (joint, effort_enforcer(joint.limits)) for joint in self.effort_joints
        ]

    @property
    def pids(self) -> dict[str, Pid]:
        """The PIDs of the drives, by their namespace below the robot's."""
        return {f"{GAINS}/{d.joint.name}": d.pid for d in self.drives if d.pid is not None}

    @property
    def loops(self) -> list[Loop]:
        """The PIDs of the drives, and what they are around."""
        return [
            Loop(d.joint.name, d.pid, isinstance(d, VelocityDrive))
            for d in self.drives
            if d.pid is not None
        ]

    def joint(self, interface: str, name: str) -> JointHandle:
        """Returns joint `name` of `interface`.

        Raises:
            ControlError: if the robot has no such interface, or the joint isn't in it.
        """
        joints = self.interfaces.get(interface)
        if joints is None:
            raise ControlError(f"the robot has no hardware_interface::{interface}")
        if name not in joints:
            known = ", ".join(sorted(joints)) or "none"
            raise ControlError(
                f"joint '{name}' is not in hardware_interface::{interface} (it has: {known})"
            )
        return joints[name]

    def relatch(self, names: Iterable[str] | None = None) -> None:
        """Lets go of joints (default: all), or holds them where they are; what was commanded before is
        forgotten."""
        wanted = set(self.joints if names is None else names)
        for joint in self.effort_joints:
            if joint.name in wanted:
                joint.command = 0.0
        for drive in self.drives:
            if drive.joint.name in wanted:
                drive.relatch()

    def halt(self) -> None:
        """An emergency stop: no effort, no velocity, and positions as they are.

        See docs/contract/gazebo_ros_control.md 6.7.
        """
        if not self.halted:
            for drive in self.drives:
                drive.begin_hold()
        self.halted = True

    def resume(self) -> None:
        """Ends an emergency stop."""
        self.halted = False

    def _of(self, interface: str) -> list[JointHandle]:
        joints = self.interfaces.get(interface, {})
        return [joints[name] for name in sorted(joints)]

    def _drives(self, gains: Mapping[str, object]) -> list[Drive]:
        return [
            *(PositionDrive(j, drive_pid(gains, j.name)) for j in self._of(POSITION)),
            *(VelocityDrive(j, drive_pid(gains, j.name)) for j in self._of(VELOCITY)),
        ]


def drive_pid(gains: Mapping[str, object], joint: str) -> Pid | None:
    """Returns the PID that the gains name for `joint`; None if they name no `p`."""
    params = gains.get(joint)
    if not isinstance(params, Mapping) or "p" not in params:
        return None
    return Pid.from_params(params, f"{GAINS}/{joint}")
