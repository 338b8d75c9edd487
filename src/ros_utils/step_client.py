"""Moving a world in lock-step from Python: a client for `/gazebo/step_world` (bullet_gazebo_msgs/StepWorld).

client = StepClient()
client.reset({"cart_pole": 0.1}, {"cart_pole": -0.5})
state = client.step(8, {"stand_cart_position_controller": 0.02}, links=["pole"], contacts=["pole"])
state.joint_states.position, state.sim_time, state.link_poses[0].position.z, state.contacts
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from typing import Any

from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest, StepWorldResponse
from geometry_msgs.msg import Pose, Twist

from ros_calls.service import ServiceClient, ServiceFailed

STEP_SERVICE = "/gazebo/step_world"
TIMEOUT = 10.0  # [s] of wall time
SLOWEST_TICK = 0.01  # [s] of wall time; one of a very full world
Commands = Mapping[str, float | Sequence[float]]
Some = bool | Sequence[str]
"""All, none, or those of these names."""


class StepRefused(ServiceFailed):
    """The simulator didn't do what was asked for, and nothing has changed; the text says why."""


class StepClient:
    """Steps a world over a lasting connection, which is renewed after a restart of the simulator.

    No call takes longer than `timeout` [s] of wall time, and 10 ms for each of its ticks. Errors are those of
    ros_utils.service_client (ServiceGone, ServiceHangs, ServiceFailed), and StepRefused.
    """

    def __init__(self, service: str = STEP_SERVICE, timeout: float = TIMEOUT) -> None:
        self._timeout = timeout
        self._call = ServiceClient(service, StepWorld, persistent=True, timeout=timeout, polls=True)

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
        request = _request(ticks, commands or {}, joint_commands or {})
        _ask(request, model_states, links, contacts)
        return self._answer(request, self._call)

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
        request = _request(ticks, commands or {}, {})
        _ask(request, model_states, links, contacts)
        request.models = list(models)
        request.poses = list(models.values())
        request.twists = [(twists or {}).get(name, Twist()) for name in models]
        request.reset = StepWorldRequest.SIMULATION if everything else StepWorldRequest.WORLD
        request.seed = seed
        request.joints = list(positions)
        request.positions = list(positions.values())
        request.velocities = [(velocities or {}).get(name, 0.0) for name in positions]
        # The simulator may have been restarted since the last call.
        return self._answer(request, self._call.call_idempotent)

    def send(self, request: StepWorldRequest) -> StepWorldResponse:
        """Sends a request as it is: the fast way for whoever keeps one and changes its fields."""
        return self._answer(request, self._call)

    def _answer(self, request: StepWorldRequest, call: Callable[..., Any]) -> StepWorldResponse:
        self._call.timeout = self._timeout + time_of(request.ticks)
        response: StepWorldResponse = call(request)
        if not response.success:
            raise StepRefused(response.status_message)
        return response

    def close(self) -> None:
        """Gives the connection up; the next call makes a new one."""
        self._call.close()


def time_of(ticks: Any) -> float:
    """The most wall time [s] that steps take; what is no number of ticks is refused elsewhere."""
    return SLOWEST_TICK * max(0, int(ticks)) if isinstance(ticks, Integral) else 0.0


def _request(
    ticks: int, commands: Commands, joint_commands: Mapping[str, float]
) -> StepWorldRequest:
    values: list[float] = []
    for command in commands.values():
        # Nearly always; whether it is a Sequence takes longer to tell.
        if isinstance(command, float):
            values.append(command)
        else:
            values += command if isinstance(command, Sequence) else [command]
    return StepWorldRequest(
        ticks=ticks,
        controllers=list(commands),
        commands=values,
        commanded_joints=list(joint_commands),
        joint_commands=list(joint_commands.values()),
    )


def _ask(
    request: StepWorldRequest,
    model_states: Some,
    links: Sequence[str] | Mapping[str, str],
    contacts: Some,
) -> None:
    """Has a request ask for more than the joints."""
    request.model_states, request.model_states_of = _chosen(model_states)
    request.contacts, request.contacts_of = _chosen(contacts)
    request.link_states_of = list(links)
    if isinstance(links, Mapping):
        request.link_frames = list(links.values())


def _chosen(some: Some) -> tuple[bool, list[str]]:
    return (some, []) if isinstance(some, bool) else (False, list(some))
