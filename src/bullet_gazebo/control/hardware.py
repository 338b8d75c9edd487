"""A robot's hardware as ros_control sees it: joints by interface, and what writes their commands."""

from bullet_gazebo.control.description import RobotDescription
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.limits import Enforcer, effort_enforcer

EFFORT = "EffortJointInterface"
STATE = "JointStateInterface"


class RobotHardware:
    """The joints that have a transmission (contract: gazebo_api.md sections 6.3 and 6.4).

    `joints` is in alphabetical order, the order of joint states.
    """

    def __init__(self, description: RobotDescription) -> None:
        """Errors: ControlError if a transmission's joint isn't in the description."""
        self.urdf_joints = description.joints
        self.interfaces: dict[str, dict[str, JointHandle]] = {}
        for transmission in description.transmissions:
            joint = description.joints.get(transmission.joint)
            if joint is None:
                raise ControlError(f"transmission of joint '{transmission.joint}': no such joint")
            self.interfaces.setdefault(transmission.interface, {})[joint.name] = joint
        found = {name: j for group in self.interfaces.values() for name, j in group.items()}
        self.joints = {name: found[name] for name in sorted(found)}
        self._enforcers: list[tuple[Enforcer, JointHandle]] = []
        for joint in self.interfaces.get(EFFORT, {}).values():
            enforce = effort_enforcer(joint.limits)
            if enforce is not None:
                self._enforcers.append((enforce, joint))

    def joint(self, interface: str, name: str) -> JointHandle:
        """Returns joint `name` of `interface`.

        Errors: ControlError if the robot has no such interface, or the joint isn't in it.
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

    def enforce_limits(self) -> None:
        """Clips every command in place; done on each step, also between control periods."""
        for enforce, joint in self._enforcers:
            enforce(joint)

    def clear_commands(self) -> None:
        """Lets go of every joint: what the last command of a stopped controller was is forgotten."""
        for joint in self.joints.values():
            joint.command = 0.0
