"""The page's controls of time, and its list of controllers, which also take commands from sliders."""

import html
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import rospy
import viser
from controller_manager_msgs.msg import ControllerState
from controller_manager_msgs.utils import ControllerLister, ControllerManagerLister
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bullet_gazebo.window.remote_scene import Commands
from ros_calls.commands import COMMANDS
from ros_calls.service import ServiceFailed
from ros_calls.waiting import wait_until

SPEEDS = {
    "0.1 ×": 0.1, "0.25 ×": 0.25, "0.5 ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "5 ×": 5.0,
    "unlimited": 0.0,
}  # fmt: skip
OTHER = "other"
MOST_STEPS = 100_000
STILL = 0.005  # of real time; no one sees a slower pace
ONLY_STEPS = "a world in lock-step moves only by steps: a client's, or these here"
MANAGER = "controller_manager"
SINGLE, GROUP = "JointPositionController", "JointGroupPositionController"
TRAJECTORY = "JointTrajectoryController"
KINDS = {SINGLE: COMMANDS["Float64"], GROUP: COMMANDS["Float64MultiArray"]}
MOVE_TIME = 0.5  # [s of simulated time] that a trajectory to the slider's position takes
CONNECTING = 5.0  # [s]

Attempt = Callable[[Callable[[], None]], None]
"""Carries out a click, and shows what went wrong."""


class TimePanel:
    """Shows the time, and controls it."""

    def __init__(self, gui: viser.GuiApi, commands: Commands, attempt: Attempt) -> None:
        self._commands = commands
        self._attempt = attempt
        self.stands = False  # whether time stands still
        self._paused = False
        self._lockstep = False
        self._status = gui.add_html("")
        self._pause = gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
        self._pause.on_click(lambda _: attempt(lambda: commands.set_paused(not self._paused)))
        one = gui.add_button("One step", icon=viser.Icon.PLAYER_SKIP_FORWARD)
        one.on_click(lambda _: attempt(lambda: commands.step(1)))
        steps = gui.add_number("Steps", 100, min=1, max=MOST_STEPS, step=1)
        many = gui.add_button("Do these steps", icon=viser.Icon.PLAYER_TRACK_NEXT)
        many.on_click(lambda _: attempt(lambda: commands.step(int(steps.value))))
        world = gui.add_button(
            "Reset world", hint="put models back to where they were spawned; time continues"
        )
        world.on_click(lambda _: attempt(lambda: commands.reset(everything=False)))
        simulation = gui.add_button("Reset simulation", hint="set joints and time to zero as well")
        simulation.on_click(lambda _: attempt(lambda: commands.reset(everything=True)))
        self._speed = gui.add_dropdown("Speed", [*SPEEDS, OTHER], initial_value="1 ×")
        self._speed.on_update(self._choose_speed)

    def _choose_speed(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is not None and self._speed.value != OTHER:  # someone chose it
            self._attempt(lambda: self._commands.set_speed(SPEEDS[self._speed.value]))

    def show(self, now: float, factor: float, paused: bool, lockstep: bool) -> None:
        """Shows the time [s], the real-time factor, and what moves time."""
        self.stands = paused or (lockstep and factor < STILL)
        if (paused, lockstep) != (self._paused, self._lockstep):
            self._paused, self._lockstep = paused, lockstep
            goes_on = paused and not lockstep
            self._pause.label = "Resume" if goes_on else "Pause"
            self._pause.icon = viser.Icon.PLAYER_PLAY if goes_on else viser.Icon.PLAYER_PAUSE
            for each in (self._pause, self._speed):  # neither does anything in lock-step
                each.disabled = lockstep
                each.hint = ONLY_STEPS if lockstep else None
        if lockstep and factor < STILL:
            state = "lock-step, waits for a client's steps"
        elif lockstep:
            state = f"lock-step, {factor:.{2 if factor < 10 else 0}f} × real time"
        else:
            state = "paused" if paused else f"real-time factor {factor:.2f}"
        self._write(f"<b>{now:.3f} s</b> &nbsp; {state}")

    def show_missing(self, node: str) -> None:
        """Shows that there is no simulator."""
        self._write(f"no simulator {node} (yet)")

    def show_speed(self) -> None:
        """Shows the speed in force, which another client may have set."""
        physics = self._commands.physics()
        factor = physics.max_update_rate * physics.time_step
        names = [name for name, each in SPEEDS.items() if abs(each - factor) < 1e-6]
        self._speed.value = names[0] if names else OTHER  # type: ignore[misc]

    def _write(self, text: str) -> None:
        self._status.content = f'<div style="padding: 0.4em 0.8em">{text}</div>'


@dataclass(frozen=True)
class Holder:
    """A running controller; `joints` are all that it claims."""

    topic: str
    kind: str
    joints: tuple[str, ...]


class Controllers:
    """All controller managers of the graph. `look` asks them; the other methods use what it found."""

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
        """Returns the managers and their controllers with state, type and joints."""
        if not self._found:
            return "no controller manager"
        lines: list[str] = []
        for manager, controllers in self._found.items():
            lines.append(f"<b>{html.escape(manager)}</b><ul style='margin: 0; padding-left: 1.2em'>")
            for each in controllers:
                joints = ", ".join(html.escape(joint) for joint in _claimed(each))
                weight = 600 if each.state == "running" else 400
                lines.append(
                    f"<li><span style='font-weight: {weight}'>{html.escape(each.name)}</span>: "
                    f"{html.escape(each.state)}<br><small>{html.escape(each.type)}"
                    f"{f' of {joints}' if joints else ''}</small></li>"
                )
            lines.append("</ul>")
        return "".join(lines)

    def holder(self, joint: str) -> Holder | str:
        """Returns the running controller that takes positions of `joint`, or why there is none."""
        claims = [each for each in self._running() if joint in each.joints]
        holders = [each for each in claims if each.kind in (*KINDS, TRAJECTORY)]
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

    def command(self, holder: Holder, joint: str, positions: dict[str, float], seconds: float) -> None:
        """Sends `joint` to its position [rad, m] in `positions`, which has those of all other joints, too.

        A trajectory takes `seconds` of simulated time. Raises ServiceFailed if no controller subscribes.
        """
        kind = KINDS.get(holder.kind)
        message = kind.message_type if kind else JointTrajectory
        if holder.topic not in self._publishers:
            self._publishers[holder.topic] = rospy.Publisher(holder.topic, message, queue_size=1)
        publisher = self._publishers[holder.topic]
        if not wait_until(publisher.get_num_connections, CONNECTING, holder.topic):
            raise ServiceFailed(f"{holder.topic}: no controller listens to commands")
        order = list(holder.joints)
        if holder.kind == GROUP:  # claims are sorted, commands are in the parameter's order
            order = list(rospy.get_param(holder.topic.removesuffix("command") + "joints", order))
        targets = [positions.get(each, 0.0) for each in order]
        if kind is not None:
            publisher.publish(kind.write(positions[joint] if kind.single else targets))
        else:
            point = JointTrajectoryPoint(positions=targets, time_from_start=rospy.Duration.from_sec(seconds))
            publisher.publish(JointTrajectory(joint_names=order, points=[point]))


def _taken(kind: str) -> str:
    """Returns what a controller of another kind takes."""
    kinds = [each for each in ("effort", "velocity") if each in kind.lower()]
    return {"effort": "efforts", "velocity": "velocities"}[kinds[0]] if kinds else "no positions"


def _claimed(controller: ControllerState) -> list[str]:
    return [joint for claim in controller.claimed_resources for joint in claim.resources]
