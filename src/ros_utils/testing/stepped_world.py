"""A world whose time passes on request: its commands and its readings."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from bullet_gazebo_msgs.srv import StepWorldRequest

from file_access.text import did_you_mean
from ros_utils import ros_gazebo
from ros_utils.step_client import PreparedSteps, StepAnswer, StepClient, StepNames, StepRefused
from ros_utils.testing.followed_node import FollowedNode, WorldError

NANOSECONDS = 1_000_000_000
MOTION = 13  # numbers per link: position, orientation, velocities
Vector = tuple[float, float, float]


class SteppedWorld:
    """A simulated world in lock-step, which is emptied, at time 0, when this object is made.

    `seed` is that of the sensors' noise, at least 1.
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._steps, self._client = PreparedSteps(), StepClient()
        self._commands: dict[str, Sequence[float]] = {}  # for the next step
        # The tick in which a command was given, its period in ticks, and the command.
        self._repeated: dict[str, tuple[int, int, Sequence[float]]] = {}
        self._passed = 0  # ticks
        self._nodes: list[FollowedNode] = []
        self._links: dict[tuple[str, str], None] = {}
        self._touched: dict[str, None] = {}
        self._sensors: dict[str, None] = {}
        for name in ros_gazebo.gazebo_get_model_names():
            if name != "ground_plane":
                ros_gazebo.gazebo_delete_model(name)
        self._client.send(StepWorldRequest(reset=StepWorldRequest.SIMULATION, seed=seed))
        self._period = round(ros_gazebo.gazebo_get_time_step() * NANOSECONDS)  # [ns]
        self._state = self._step(0)

    def close(self) -> None:
        """Ends the nodes, and the connections to the simulator."""
        for node in self._nodes:
            node.close()
        self._steps.close()
        self._client.close()

    def follow(
        self, package: str, executable: str, *, hears: str, commands: str, args: Sequence[str] = ()
    ) -> None:
        """Starts a node, in whatever language, that commands a controller; it ends with the test.

        From then on, time waits for it: it has to answer each message that it hears with one command.

        Args:
            package: Package of the node.
            executable: As for rosrun.
            hears: A topic of the simulator's, such as /joint_states.
            commands: The topic of its commands, such as /elbow_controller/command; of the types Float64,
                Float64MultiArray and Twist.
            args: Arguments of the node.
        """
        name = f"{executable.partition('.')[0]}_under_test_{len(self._nodes)}"
        self._nodes.append(FollowedNode(name, package, executable, args, hears, commands))

    def command(self, controller: str, *values: float, every: float | None = None) -> None:
        """Commands a running controller from the next step on.

        Args:
            controller: Its name, or /namespace/name where several robots have one of that name.
            values: As many as its command topic takes [rad, m, rad/s, m/s, N m, N]; of a vehicle ahead, to
                the left and about.
            every: Period in which it is sent again, until the next command [s]: a vehicle that hears none
                for a while stops. None: it is sent once.
        """
        self._repeated.pop(controller, None)
        if every is not None:
            ticks = self._ticks(every)
            if not ticks:
                raise WorldError("a command can't be sent every 0 s: a physics step or more is needed")
            self._repeated[controller] = self._passed, ticks, values
        self._commands[controller] = values

    @property
    def time(self) -> float:
        """Simulated time since the test began [s]."""
        return self._state.now / NANOSECONDS

    def wait(self, duration: float) -> None:
        """Lets simulated time pass [s]."""
        self._state = self._step(self._ticks(duration))

    def _ticks(self, duration: float) -> int:
        ticks = round(duration * NANOSECONDS / self._period) if math.isfinite(duration) else -1
        if ticks < 0 or abs(ticks * self._period - duration * NANOSECONDS) > 1.0:
            raise WorldError(f"{duration} s isn't a number of steps of {self._period / 1e6:g} ms")
        return ticks

    def _step(self, ticks: int) -> StepAnswer:
        """Lets time pass in parts, between which commands are repeated and followed nodes answer."""
        answer = None
        while ticks:
            repeated = self._repeated.values()
            left = [period - (self._passed - begin) % period for begin, period, _ in repeated]
            passed = min([ticks, *left])
            if self._nodes and not self._commands:
                answer, passed = None, self._nodes[0].advance(passed)
            else:
                passed = 1 if self._nodes else passed
                answer = self._prepared_step(passed)
            ticks -= passed
            self._passed += passed
            for controller, (begin, period, values) in self._repeated.items():
                if (self._passed - begin) % period == 0:
                    self._commands[controller] = values
            for node in self._nodes:
                if values := node.answer():
                    self._commands[node.controller] = values
        return answer or self._prepared_step(0)

    def _prepared_step(self, ticks: int) -> StepAnswer:
        commands = self._commands if ticks else {}
        names = StepNames(
            controllers=tuple(commands),
            links=tuple(link for link, _ in self._links),
            frames=tuple(frame for _, frame in self._links),
            contacts_of=tuple(self._touched),
            sensors=tuple(self._sensors),
        )
        numbers = [number for values in commands.values() for number in values]
        if ticks:
            self._commands = {}  # also if they are refused
        try:
            self._steps.begin(names, ticks, numbers)
            return self._steps.end()
        except StepRefused as fault:
            for controller in commands:
                self._repeated.pop(controller, None)
            given = "; ".join(f"{name}: {', '.join(map(str, commands[name]))}" for name in commands)
            raise WorldError(f"{fault}" + (f" (commanded: {given})" if given else "")) from fault

    def _look(self, names: dict[Any, None], name: Any) -> None:
        """Reads more in each step from now on, unless the simulator refuses it."""
        if name not in names:
            names[name] = None
            try:
                self._state = self._step(0)
            except WorldError:
                del names[name]
                raise

    def joint(self, name: str) -> float:
        """Returns the position of a joint with a transmission [rad, m]."""
        joints = list(self._state.joints)
        if name not in joints:
            near = did_you_mean(name, joints) or f"; there are: {', '.join(joints) or 'none'}"
            raise WorldError(f"there is no joint '{name}' with a transmission{near}")
        return float(self._state.numbers[joints.index(name)])

    def link(self, name: str, frame: str = "") -> Vector:
        """Returns the position of a link [m], or model::link, in the world or in another link's frame."""
        self._look(self._links, (name, frame))
        first = 3 * len(self._state.joints) + MOTION * list(self._links).index((name, frame))
        x, y, z = self._state.numbers[first : first + 3]
        return (x, y, z)

    def contacts(self, link: str) -> list[str]:
        """Returns the collisions that a link, or model::link, touches, as model::link::collision."""
        self._look(self._touched, link)
        touched: dict[str, None] = {}
        for each in self._state.contacts:
            pair = each.collision1_name, each.collision2_name
            for mine, other in (pair, pair[::-1]):
                if f"::{link}::" in f"::{mine}":
                    touched[other] = None
        return list(touched)

    def sensor(self, name: str) -> dict[str, np.ndarray]:
        """Returns the last measurement of a sensor, or model::sensor; empty before the first.

        A laser has `ranges` [m]. It measures from the first call on.
        """
        self._look(self._sensors, name)
        reading = self._state.sensors[list(self._sensors).index(name)]
        return {
            each.name: np.frombuffer(bytes(each.data), each.type).reshape(each.shape)
            for each in reading.values
        }
