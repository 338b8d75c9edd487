"""Client for a world in lock-step, through the services of bullet_gazebo_msgs.

client = StepClient()
client.reset({"cart_pole": 0.1}, {"cart_pole": -0.5})
state = client.step(8, {"stand_cart_position_controller": 0.02}, links=["pole"], contacts=["pole"])
state.joint_states.position, state.sim_time, state.link_poses[0].position.z, state.contacts
"""

from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from typing import Any, NamedTuple

import genpy
from bullet_gazebo_msgs.msg import SensorReading
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
SLOWEST_TICK = 0.01  # [s] of wall time; a tick of a very full world
MOST_PREPARED = 16  # prepared steps kept; older ones are prepared again
ATTEMPTS = 3  # to prepare a step again while controllers or models come and go
MOTION = 13  # numbers per model or link: position, orientation, linear and angular velocity
Commands = Mapping[str, float | Sequence[float]]
Some = bool | Sequence[str]
"""All, none, or those of these names."""


class StepRefused(ServiceFailed):
    """The simulator rejected a request and changed nothing; the text says why."""


class StepNames(NamedTuple):
    """The names that a step commands and reads; the fields are those of PrepareStep.srv."""

    controllers: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    all_models: bool = False
    models: tuple[str, ...] = ()
    links: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    all_contacts: bool = False
    contacts_of: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()


class StepAnswer(NamedTuple):
    """The world after a prepared step."""

    now: int  # simulated time [ns]
    joints: Sequence[str]
    models: Sequence[str]
    numbers: Sequence[float]  # see PreparedStep.srv
    contacts: Sequence[ContactState]
    sensors: Sequence[SensorReading]


class PreparedSteps:
    """Steps whose names the simulator looks up once; requests and answers are plain numbers.

    A step is `begin` and `end`, so several simulators can move in parallel. Not thread-safe.

    Args:
        service: The simulator's step_world; prepare_step and prepared_step share its namespace.
        timeout: Limit of a call [s of wall time], plus 10 ms for each tick.
        client: The clients' class, which decides what errors are raised.
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
        self._step = client(f"{parent}/prepared_step", PreparedStep, persistent=True, timeout=timeout)
        self._prepared: dict[StepNames, PrepareStepResponse] = {}
        self._begun = StepNames(), PreparedStepRequest()

    def prepare(self, names: StepNames) -> PrepareStepResponse:
        """Prepares a step if it isn't yet; returns the names that the answers' numbers belong to.

        Raises:
            ServiceFailed: StepRefused for a wrong name; otherwise see `ServiceClient`.
        """
        prepared = self._prepared.get(names)
        if prepared is None:
            prepared = self._prepare(*names)
            if not prepared.success:
                raise StepRefused(prepared.status_message)
            if len(self._prepared) >= MOST_PREPARED:
                self._prepared.clear()
            self._prepared[names] = prepared
        return prepared

    def begin(self, names: StepNames, ticks: int, commands: Sequence[float]) -> None:
        """Sends a step; `end` takes its answer and must come next.

        Args:
            names: What the commands are for, and what the answer reports.
            ticks: Number of physics steps; 0 only reads.
            commands: Numbers for the controllers, then for the joints.

        Raises:
            ServiceFailed: See `prepare`.
        """
        request = PreparedStepRequest(self.prepare(names).handle, ticks, commands)
        self._begun = names, request
        self._step.timeout = self._timeout + time_of(ticks)
        self._step.begin(request)

    def end(self) -> StepAnswer:
        """Returns the answer; prepares and sends the step again if its handle was stale.

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
            answer.now, prepared.joints, prepared.models, answer.numbers, answer.contacts,
            answer.sensors,
        )  # fmt: skip

    def close(self) -> None:
        """Closes the connections; the next call opens new ones."""
        self._prepare.close()
        self._step.close()


class StepClient:
    """Steps a world over persistent connections, and reconnects after a restart of the simulator.

    A call takes at most `timeout` [s of wall time] plus 10 ms for each of its ticks. It raises the errors of
    ros_utils.service_client (ServiceGone, ServiceHangs, ServiceFailed) and StepRefused.

    Args:
        service: The simulator's step_world; its other services share the namespace.
        timeout: Limit of a call [s].
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
        """Commands controllers and joints, lets `ticks` physics steps pass, and returns the new state.

        Besides the joints, the answer holds only what is asked for; the rest costs nothing.

        Args:
            ticks: At least 1; 0 if models, links or contacts are asked for, which only reports.
            commands: By controller name: a number, or for a group one per joint
                [m, rad, m/s, rad/s, N, N m].
            joint_commands: For joints without a running controller, by name.
            model_states: Models whose poses and twists are reported.
            links: Links whose poses and twists are reported, in this order: plain names, or
                model::link. A mapping gives the link in whose frame each is reported; "": the world.
            contacts: Contacts of the last tick: all, or those of these models, links or collisions.
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
        except BaseException:  # a signal handler may raise between begin and end
            self.close()
            raise
        return _response(answer)

    def reset(
        self, positions: Mapping[str, float] | None = None, velocities: Mapping[str, float] | None = None,
        *, seed: int = 0, everything: bool = False, ticks: int = 0, commands: Commands | None = None,
        models: Mapping[str, Pose] | None = None, twists: Mapping[str, Twist] | None = None,
        model_states: Some = False, links: Sequence[str] | Mapping[str, str] = (), contacts: Some = False,
    ) -> StepWorldResponse:  # fmt: skip
        """Resets the world, begins an episode from a defined state, and returns that state.

        Args:
            positions: Joint positions [rad, m]. Other joints stay, or go to 0 with `everything`.
            velocities: Velocities of the placed joints [rad/s, m/s]; the others rest.
            seed: Seed of the simulator's random numbers; 0 leaves them.
            everything: True as reset_simulation: time starts at 0. False as reset_world: time continues.
            models: Poses of models in the world; the others stand where they were spawned.
            twists: Twists of the placed models; the others rest.
            ticks, commands, model_states, links, contacts: As for `step`; no step unless asked for.
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
        """Sends a request unchanged and returns the response."""
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
    """Returns the longest wall time [s] for steps; bad numbers of ticks are rejected elsewhere."""
    return SLOWEST_TICK * max(0, int(ticks)) if isinstance(ticks, Integral) else 0.0


def _flat(commands: Commands) -> list[float]:
    values: list[float] = []
    for command in commands.values():
        if isinstance(command, float):  # the usual case; isinstance of Sequence is slow
            values.append(command)
        else:
            values += command if isinstance(command, Sequence) else [command]
    return values


def _response(answer: StepAnswer) -> StepWorldResponse:
    """Returns the answer in the form of step_world's response."""
    numbers, joints, models = answer.numbers, len(answer.joints), len(answer.models)
    rest = range(3 * joints, len(numbers), MOTION)
    poses = [Pose(Point(*numbers[i : i + 3]), Quaternion(*numbers[i + 3 : i + 7])) for i in rest]
    twists = [Twist(Vector3(*numbers[i + 7 : i + 10]), Vector3(*numbers[i + 10 : i + 13])) for i in rest]
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
