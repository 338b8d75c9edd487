"""Moves a world in lock-step from Python, by the services of bullet_gazebo_msgs.

client = StepClient()
client.reset({"cart_pole": 0.1}, {"cart_pole": -0.5})
state = client.step(8, {"stand_cart_position_controller": 0.02}, links=["pole"], contacts=["pole"])
state.joint_states.position, state.sim_time, state.link_poses[0].position.z, state.contacts
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from typing import Any, NamedTuple

import genpy
from bullet_gazebo_msgs.srv import (
    PreparedStep,
    PreparedStepRequest,
    PreparedStepResponse,
    PrepareStep,
    PrepareStepResponse,
    StepWorld,
    StepWorldRequest,
    StepWorldResponse,
)
from gazebo_msgs.msg import ContactState
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ros_calls.service import ServiceClient, ServiceFailed, ServiceGone

STEP_SERVICE = "/gazebo/step_world"
TIMEOUT = 10.0  # [s] of wall time
SLOWEST_TICK = 0.01  # [s] of wall time; one of a very full world
MOST_PREPARED = 16  # steps with different names; older ones are prepared again
ATTEMPTS = 3  # to prepare a step anew while controllers or models come and go
MOTION = 13  # numbers of a model or link: position, orientation, linear and angular velocity
Commands = Mapping[str, float | Sequence[float]]
Some = bool | Sequence[str]
"""All, none, or those of these names."""


class StepRefused(ServiceFailed):
    """The simulator refused a request, and nothing has changed; the text says why."""


class StepNames(NamedTuple):
    """What a step commands and reads, in the words of PrepareStep.srv."""

    controllers: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    all_models: bool = False
    models: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    all_contacts: bool = False
    contacts_of: tuple[str, ...] = ()


class StepAnswer(NamedTuple):
    """The world after a prepared step."""

    now: int  # simulated time [ns]
    joints: Sequence[str]
    models: Sequence[str]
    numbers: Sequence[float]  # see PreparedStep.srv
    contacts: Sequence[ContactState]


class PreparedSteps:
    """Steps whose names the simulator looks up once; requests and answers are numbers.

    A step is `begin` and `end`, so that several simulators can move at the same time. Not thread-safe.

    Args:
        service: the simulator's step_world; prepare_step and prepared_step stand beside it.
        timeout: wall time [s] that a call may take, beside 10 ms for each tick.
        client: the class of the clients, which decides on the errors.
    """

    def __init__(
        self,
        service: str = STEP_SERVICE,
        timeout: float = TIMEOUT,
        client: Callable[..., ServiceClient] = ServiceClient,
    ) -> None:
        parent = service.rpartition("/")[0]
        self._timeout = timeout
        self._prepare = client(f"{parent}/prepare_step", PrepareStep, timeout=timeout)
        self._step = client(
            f"{parent}/prepared_step", PreparedStep, persistent=True, timeout=timeout
        )
        self._prepared: dict[StepNames, PrepareStepResponse] = {}
        self._begun = StepNames(), PreparedStepRequest()

    def prepare(self, names: StepNames) -> PrepareStepResponse:
        """Has the names looked up, unless they have been; returns what the answers' numbers belong to.

        Raises:
            ServiceFailed: StepRefused for a wrong name; otherwise see `ServiceClient`.
        """
        found = self._prepared.get(names)
        if found is None:
            found = self._prepare(*names)
            if not found.success:
                raise StepRefused(found.status_message)
            if len(self._prepared) >= MOST_PREPARED:
                self._prepared.clear()
            self._prepared[names] = found
        return found

    def begin(self, names: StepNames, ticks: int, commands: Sequence[float]) -> None:
        """Sends a step; `end` takes its answer and must come next.

        Args:
            names: whom the commands are for, and what the answer tells.
            ticks: physics steps; 0 only reads.
            commands: for the controllers, then for the joints.

        Raises:
            ServiceFailed: see `prepare`.
        """
        request = PreparedStepRequest(self.prepare(names).handle, ticks, commands)
        self._begun = names, request
        self._step.timeout = self._timeout + time_of(ticks)
        self._step.begin(request)

    def end(self) -> StepAnswer:
        """Takes the answer; a step whose handle was stale is prepared and sent again.

        Raises:
            ServiceFailed: StepRefused for a refused step; otherwise see `ServiceClient`.
        """
        names, request = self._begun
        answer: PreparedStepResponse = self._step.end()
        for _ in range(ATTEMPTS):
            if not answer.stale:
                break
            del self._prepared[names]
            request.handle = self.prepare(names).handle
            answer = self._step(request)
        if not answer.success:
            raise StepRefused(answer.status_message)
        prepared = self._prepared[names]
        return StepAnswer(
            answer.now, prepared.joints, prepared.models, answer.numbers, answer.contacts
        )

    def close(self) -> None:
        """Closes the connections; the next call opens new ones."""
        self._prepare.close()
        self._step.close()


class StepClient:
    """Steps a world over lasting connections, which are renewed after a restart of the simulator.

    No call takes longer than `timeout` [s] of wall time, and 10 ms for each of its ticks. Errors are those of
    ros_utils.service_client (ServiceGone, ServiceHangs, ServiceFailed), and StepRefused.

    Args:
        service: the simulator's step_world; its other services stand beside it.
        timeout: bound of a call [s].
    """

    def __init__(self, service: str = STEP_SERVICE, timeout: float = TIMEOUT) -> None:
        self._timeout = timeout
        self._call = ServiceClient(service, StepWorld, persistent=True, timeout=timeout)
        self._prepared = PreparedSteps(service, timeout)

    def step(
        self,
        ticks: int,
        commands: Commands | None = None,
        *,
        joint_commands: Mapping[str, float] | None = None,
        model_states: Some = False,
        links: Sequence[str] | Mapping[str, str] = (),
        contacts: Some = False,
    ) -> StepWorldResponse:
        """Commands controllers and joints, and lets `ticks` physics steps pass.

        What the answer tells beside the joints costs nothing where it isn't asked for.

        Args:
            ticks: at least 1.
            commands: for controllers by name: a number, or as many as a group has joints
                [m, rad, m/s, rad/s, N, N m].
            joint_commands: for joints that no running controller has.
            model_states: which models' poses and twists are told.
            links: whose poses and twists are told, in this order: a plain name, or model::link. A
                mapping says in which link's frame each is told; "": in the world.
            contacts: those of the last tick: all, or those with these models, links or collisions.
        """
        commands, joint_commands = commands or {}, joint_commands or {}
        all_models, models = _chosen(model_states)
        all_contacts, contacts_of = _chosen(contacts)
        frames = tuple(links.values()) if isinstance(links, Mapping) else ()
        names = StepNames(
            tuple(commands), tuple(joint_commands), all_models, tuple(models), tuple(links), frames,
            all_contacts, tuple(contacts_of),
        )  # fmt: skip
        if ticks == 0 and names == StepNames(names.controllers, names.joints):
            raise StepRefused("ticks is 0, and nothing is asked for but the joints")
        try:
            self._prepared.begin(names, ticks, [*_flat(commands), *joint_commands.values()])
            answer = self._prepared.end()
        except StepRefused:
            raise
        except BaseException:  # also of a signal's handler, between begin and end
            self.close()
            raise
        return _response(answer)

    def reset(
        self,
        positions: Mapping[str, float] | None = None,
        velocities: Mapping[str, float] | None = None,
        *,
        seed: int = 0,
        everything: bool = False,
        ticks: int = 0,
        commands: Commands | None = None,
        models: Mapping[str, Pose] | None = None,
        twists: Mapping[str, Twist] | None = None,
        model_states: Some = False,
        links: Sequence[str] | Mapping[str, str] = (),
        contacts: Some = False,
    ) -> StepWorldResponse:
        """Resets the world, and begins an episode from a defined state.

        Args:
            positions: joints to place [rad, m]. Those that aren't named stay, or go to 0 with
                `everything`.
            velocities: of the joints that are placed [rad/s, m/s]; the others rest.
            seed: for the simulator's random numbers; 0 leaves them.
            everything: as reset_simulation, time begins at 0; else as reset_world, it goes on.
            models: models to place, in the world; the others stand where they were spawned.
            twists: of the models that are placed; the others rest.
            ticks, commands, model_states, links, contacts: as for `step`; no step unless asked for.
        """
        positions, models = positions or {}, models or {}
        for what, more, those in (
            ("velocities without positions", velocities, positions),
            ("twists without models", twists, models),
        ):
            missing = sorted(set(more or {}) - set(those))
            if missing:
                raise StepRefused(f"{what}: {missing}")
        request = StepWorldRequest(
            ticks=ticks, controllers=list(commands or {}), commands=_flat(commands or {})
        )
        request.model_states, request.model_states_of = _chosen(model_states)
        request.contacts, request.contacts_of = _chosen(contacts)
        request.link_states_of = list(links)
        request.link_frames = list(links.values()) if isinstance(links, Mapping) else []
        request.models = list(models)
        request.poses = list(models.values())
        request.twists = [(twists or {}).get(name, Twist()) for name in models]
        request.reset = StepWorldRequest.SIMULATION if everything else StepWorldRequest.WORLD
        request.seed = seed
        request.joints = list(positions)
        request.positions = list(positions.values())
        request.velocities = [(velocities or {}).get(name, 0.0) for name in positions]
        try:
            return self.send(request)
        except ServiceGone:
            self.close()  # the simulator may have been restarted since the last call
            return self.send(request)

    def send(self, request: StepWorldRequest) -> StepWorldResponse:
        """Sends a request as it is."""
        self._call.timeout = self._timeout + time_of(request.ticks)
        response: StepWorldResponse = self._call(request)
        if not response.success:
            raise StepRefused(response.status_message)
        return response

    def close(self) -> None:
        """Closes the connections; the next call opens new ones."""
        self._call.close()
        self._prepared.close()


def time_of(ticks: Any) -> float:
    """The most wall time [s] that steps take; what is no number of ticks is refused elsewhere."""
    return SLOWEST_TICK * max(0, int(ticks)) if isinstance(ticks, Integral) else 0.0


def _flat(commands: Commands) -> list[float]:
    values: list[float] = []
    for command in commands.values():
        if isinstance(command, float):  # nearly always, and isinstance of Sequence is slow
            values.append(command)
        else:
            values += command if isinstance(command, Sequence) else [command]
    return values


def _response(answer: StepAnswer) -> StepWorldResponse:
    """The answer as step_world gives it."""
    numbers, joints, models = answer.numbers, len(answer.joints), len(answer.models)
    rest = range(3 * joints, len(numbers), MOTION)
    poses = [Pose(Point(*numbers[i : i + 3]), Quaternion(*numbers[i + 3 : i + 7])) for i in rest]
    twists = [
        Twist(Vector3(*numbers[i + 7 : i + 10]), Vector3(*numbers[i + 10 : i + 13])) for i in rest
    ]
    states = JointState(
        Header(0, genpy.Time(*divmod(answer.now, 1_000_000_000)), ""),
        list(answer.joints),
        numbers[:joints],
        numbers[joints : 2 * joints],
        numbers[2 * joints : 3 * joints],
    )
    return StepWorldResponse(
        True, "", answer.now / 1e9, states, list(answer.models), poses[:models], twists[:models],
        poses[models:], twists[models:], answer.contacts,
    )  # fmt: skip


def _chosen(some: Some) -> tuple[bool, list[str]]:
    return (some, []) if isinstance(some, bool) else (False, list(some))
