"""The controllers that there are, and commands to those that hold a joint at a position."""

import html
from collections.abc import Iterator
from dataclasses import dataclass

import rospy
from controller_manager_msgs.msg import ControllerState
from std_msgs.msg import Float64, Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bullet_gazebo.ros.clients.controller_manager.discovery import (
    ControllerLister,
    ControllerManagerLister,
)
from ros_calls.service import ServiceFailed
from ros_calls.waiting import wait_until

MANAGER = "controller_manager"
SINGLE, GROUP, TRAJECTORY = (
    "JointPositionController",
    "JointGroupPositionController",
    "JointTrajectoryController",
)
MESSAGES = {SINGLE: Float64, GROUP: Float64MultiArray, TRAJECTORY: JointTrajectory}
MOVE_TIME = 0.5  # [s of simulated time] that a trajectory to the slider's position takes
CONNECTING = 5.0  # [s]
MOST_SHOWN = 100  # controllers


@dataclass(frozen=True)
class Holder:
    """A running controller; `joints` are all that it claims."""

    topic: str
    kind: str
    joints: tuple[str, ...]


class Controllers:
    """All controller managers of the graph. `look` asks them; the rest answers from what it found."""

    def __init__(self) -> None:
        self._managers = ControllerManagerLister()
        self._listers: dict[str, ControllerLister] = {}
        self._found: dict[str, list[ControllerState]] = {}
        self._publishers: dict[str, rospy.Publisher] = {}

    def look(self) -> None:
        """Asks all managers for their controllers."""
        names = self._managers()
        self._listers = {name: self._listers.get(name) or ControllerLister(name) for name in names}
        self._found = {name: lister() for name, lister in self._listers.items()}

    def as_html(self) -> str:
        """Returns the managers and their controllers, with state, type and joints."""
        if not self._found:
            return "no controller manager"
        lines: list[str] = []
        for manager, controllers in self._found.items():
            lines.append(
                f"<b>{html.escape(manager)}</b><ul style='margin: 0; padding-left: 1.2em'>"
            )
            for each in controllers[:MOST_SHOWN]:
                joints = ", ".join(html.escape(joint) for joint in _claimed(each))
                weight = 600 if each.state == "running" else 400
                lines.append(
                    f"<li><span style='font-weight: {weight}'>{html.escape(each.name)}</span>: "
                    f"{html.escape(each.state)}<br><small>{html.escape(each.type)}"
                    f"{f' of {joints}' if joints else ''}</small></li>"
                )
            rest = len(controllers) - MOST_SHOWN
            lines.append(f"<li>and {rest} more</li></ul>" if rest > 0 else "</ul>")
        return "".join(lines)

    def holder(self, joint: str) -> Holder | str:
        """Returns the running controller that takes positions of `joint`, or why there is none."""
        claims = [each for each in self._running() if joint in each.joints]
        holders = [each for each in claims if each.kind in MESSAGES]
        if len(holders) == 1:
            return holders[0]
        if holders:  # robots may have joints of the same name
            topics = " and ".join(each.topic for each in holders)
            return f"it may be the one of {topics}"
        if claims:
            return f"{claims[0].topic} takes {_taken(claims[0].kind)}"
        return "no running controller takes positions of it"

    def _running(self) -> Iterator[Holder]:
        for manager, controllers in self._found.items():
            space = manager.removesuffix(MANAGER)
            for each in controllers:
                if each.state == "running":
                    kind = each.type.rpartition("/")[2]
                    yield Holder(f"{space}{each.name}/command", kind, tuple(_claimed(each)))

    def command(self, holder: Holder, joint: str, positions: dict[str, float]) -> None:
        """Sends `joint` to its position [rad, m] in `positions`, which has those of all others, too.

        Raises:
            ServiceFailed: if the controller doesn't listen.
        """
        kind = MESSAGES[holder.kind]
        if holder.topic not in self._publishers:
            self._publishers[holder.topic] = rospy.Publisher(holder.topic, kind, queue_size=1)
        publisher = self._publishers[holder.topic]
        if not wait_until(publisher.get_num_connections, CONNECTING, holder.topic):
            raise ServiceFailed(f"{holder.topic}: nobody listens to commands")
        if holder.kind == SINGLE:
            publisher.publish(Float64(positions[joint]))
            return
        order = list(holder.joints)
        if holder.kind == GROUP:  # claims are sorted, commands are in the parameter's order
            order = list(rospy.get_param(holder.topic.removesuffix("command") + "joints", order))
        targets = [positions.get(each, 0.0) for each in order]
        if holder.kind == GROUP:
            publisher.publish(Float64MultiArray(data=targets))
        else:
            point = JointTrajectoryPoint(
                positions=targets, time_from_start=rospy.Duration.from_sec(MOVE_TIME)
            )
            publisher.publish(JointTrajectory(joint_names=order, points=[point]))


def _taken(kind: str) -> str:
    """What a controller of another kind takes."""
    found = [each for each in ("effort", "velocity") if each in kind.lower()]
    return {"effort": "efforts", "velocity": "velocities"}[found[0]] if found else "no positions"


def _claimed(controller: ControllerState) -> list[str]:
    return [joint for claim in controller.claimed_resources for joint in claim.resources]
