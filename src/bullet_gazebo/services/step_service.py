"""Services that command and advance a world in lock-step, and answer with its state.

- step_world (StepWorld.srv) resets and places as well; its requests and answers name things.
- prepare_step (PrepareStep.srv) looks names up once and returns a handle.
- prepared_step (PreparedStep.srv) takes the handle and numbers, and answers with numbers.
- set_link_friction (SetLinkFriction.srv) changes surfaces from episode to episode.
"""

import secrets
import threading
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import rospy
from bullet_gazebo_msgs import srv
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.common.messages import (
    check_numbers,
    to_contact_state,
    to_pose_msg,
    to_reading,
    to_time,
    to_twist_msg,
)
from bullet_gazebo.common.node_process import seed_random_numbers
from bullet_gazebo.services import NO_LINK, ServiceRefused, existing, offer
from bullet_gazebo.services.step_requests import MAX_TICKS, SLICE, Addresses, Commanded, StepPlan, query_of
from robot_sim.control.errors import ControlError
from robot_sim.physics.properties import PropertyError, set_link_friction
from robot_sim.sensors.sensing import Sensing
from robot_sim.sensors.sensor_readers import SensorReaders, find_sensor
from robot_sim.simulator import Simulator
from robot_sim.state import NOTHING, StateReader, UnknownName

MOST_HANDLES = 256  # a client whose handle was dropped prepares its step again
COUNTED = 24  # [bits] of a handle that count; those above are the simulator's


class _Prepared:
    """What a handle stands for."""

    def __init__(
        self, sim: Simulator, sensing: Sensing, addresses: Addresses,
        request: srv.PrepareStepRequest,
    ) -> None:  # fmt: skip
        query = query_of(request)
        for name in request.sensors:
            find_sensor(sim, sensing, name)
        self.addresses = addresses
        self.commanded = addresses.commanded(request.controllers, request.commanded_joints)
        self.reader = StateReader(sim.world, query)
        self.models = list(self.reader.read(stepped=False).models)
        self.sensors = tuple(request.sensors)

    def check(self, request: srv.PreparedStepRequest) -> None:
        """Raises ControlError if the request doesn't fit the prepared names."""
        commanded, commands = self.commanded, request.commands
        if not 0 <= request.ticks <= MAX_TICKS:
            raise ControlError(f"ticks is {request.ticks}: it is 0 to {MAX_TICKS}")
        if commanded.size + len(commanded.joints) != len(commands):
            wanted = [
                f"'{each.name}' takes {1 if isinstance(at, int) else at.stop - at.start}"
                for each, (_, at) in zip(commanded.controllers, commanded.ports, strict=True)
            ]
            wanted += [f"joint '{each.name}' takes 1" for each in commanded.joints]
            raise ControlError(f"{len(commands)} commands where {', '.join(wanted) or 'none is taken'}")
        check_numbers("commands", commands)

    def read(self, stepped: bool) -> tuple[list[float], list[object]]:
        """Returns the numbers of an answer, and the contacts."""
        joints = self.addresses.joints
        numbers = [joint.position for joint in joints]
        numbers += [joint.velocity for joint in joints]
        numbers += [joint.effort for joint in joints]
        if self.reader.query is NOTHING:
            return numbers, []
        state = self.reader.read(stepped)
        for pose, (linear, angular) in (*state.models.values(), *state.links):
            numbers += (*pose.position, *pose.orientation, *linear, *angular)
        return numbers, [to_contact_state(pair) for pair in state.contacts]


class StepService:
    """Offers the services; a request is checked as a whole before anything is done."""

    def __init__(
        self, sim: Simulator, sensing: Sensing, watchdog: AbstractContextManager[object],
        one_at_a_time: threading.Lock,
    ) -> None:  # fmt: skip
        """A fault in a block of `watchdog` ends the node; `one_at_a_time` keeps the ticks of other requests
        out of a request's.
        """
        self._sim, self._sensing = sim, sensing
        self._watchdog = watchdog
        self._one_at_a_time = one_at_a_time
        self._reader = StateReader(sim.world, NOTHING)
        self._current = Addresses(sim)
        self._prepared: dict[int, _Prepared] = {}  # by handle
        # Random, so that a handle from an earlier simulator means nothing here; and not drawn from the
        # world's own random numbers, which stay bit-identical.
        self.series = secrets.randbits(64 - COUNTED)
        self._count = 0
        self._readers: SensorReaders | None = None  # that the last step asked for
        self._is_reading = False  # whether the step under way asks for them
        sim.before_advance.append(self._end_unread)
        # Contacts are those of the last tick, until a reset or a placing makes them void.
        self._knows_contacts = False
        self._services = [
            rospy.Service("~prepare_step", srv.PrepareStep, self._prepare),
            rospy.Service("~prepared_step", srv.PreparedStep, self._step_prepared),
            rospy.Service("~step_world", srv.StepWorld, self._step),
            offer("~set_link_friction", srv.SetLinkFriction, self._set_friction),
        ]

    def _prepare(self, request: srv.PrepareStepRequest) -> srv.PrepareStepResponse:
        with self._sim.lock:
            try:
                prepared = _Prepared(self._sim, self._sensing, self._addresses(), request)
            except (ControlError, UnknownName) as error:
                return srv.PrepareStepResponse(status_message=f"PrepareStep: {error}")
            if len(self._prepared) >= MOST_HANDLES:
                del self._prepared[next(iter(self._prepared))]
            self._count += 1
            handle = self.series << COUNTED | self._count % 2**COUNTED
            self._prepared[handle] = prepared
            return srv.PrepareStepResponse(
                success=True, handle=handle, joints=prepared.addresses.joint_names, models=prepared.models
            )

    def _step_prepared(self, request: srv.PreparedStepRequest) -> srv.PreparedStepResponse:
        sim = self._sim
        with self._one_at_a_time, sim.lock:
            sim.await_holds()
            prepared = self._prepared.get(request.handle)
            if prepared is not None and prepared.addresses.version != sim.version:
                del self._prepared[request.handle]  # it would keep deleted models
                prepared = None
            if prepared is None or not prepared.commanded.is_ready:
                stale = "PreparedStep: stale"
                return srv.PreparedStepResponse(stale=True, now=sim.now, status_message=stale)
            commanded = prepared.commanded
            try:
                prepared.check(request)
                if prepared.sensors:
                    self._sense(prepared.sensors)
                commanded.send(list(request.commands[: commanded.size]))
            except (ControlError, UnknownName) as error:
                return self._refused(str(error))
            self._is_reading = bool(prepared.sensors)
            self._advance(request.ticks, commanded, request.commands[commanded.size :])
            self._is_reading = False
            try:
                if request.ticks > SLICE:
                    self._check_layout(prepared)
                numbers, contacts = prepared.read(self._knows_contacts)
            except UnknownName as error:
                return self._refused(f"the ticks are done, but meanwhile {error}")
            readers = self._readers if prepared.sensors else None
            sensors = [to_reading(*taken) for taken in readers.read()] if readers else []
            return srv.PreparedStepResponse(True, False, sim.now, "", numbers, contacts, sensors)

    def _sense(self, names: tuple[str, ...]) -> None:
        """Lets these sensors measure from now on, and no others."""
        if self._readers and self._readers.serves(names):
            return
        self._end_readers()
        self._readers = SensorReaders(self._sim, self._sensing, names)

    def _end_unread(self) -> None:
        """Ends the readers when another client steps: their owner may have disconnected."""
        if not self._is_reading:
            self._end_readers()

    def state_dict(self) -> dict[str, Any]:
        """Returns what a snapshot needs beside the simulator's state; the caller holds the lock."""
        names = self._readers.names if self._readers else ()
        return {"knows_contacts": self._knows_contacts, "sensors": names}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Takes back what `state_dict` has returned, after the simulator's state; models are the same."""
        self._knows_contacts = state["knows_contacts"]
        if state.get("sensors"):
            self._sense(state["sensors"])
        elif "sensors" in state:  # an environment's has none: its readers are those that are here
            self._end_readers()

    def _end_readers(self) -> None:
        if self._readers:
            self._readers.end()
        self._readers = None

    def _check_layout(self, prepared: _Prepared) -> None:
        """Raises UnknownName if the numbers would belong to other names now."""
        now = self._addresses().joint_names, list(prepared.reader.read(stepped=False).models)
        if (prepared.addresses.joint_names, prepared.models) != now:
            raise UnknownName("robots or models have come or gone")

    def _refused(self, fault: str) -> srv.PreparedStepResponse:
        text = f"PreparedStep: {fault}"
        return srv.PreparedStepResponse(now=self._sim.now, status_message=text)

    def _step(self, request: srv.StepWorldRequest) -> srv.StepWorldResponse:
        with self._one_at_a_time, self._sim.lock:
            self._sim.await_holds()
            try:
                # Everything is checked before anything is done.
                plan = StepPlan(self._sim, request, self._addresses())
                if plan.query != self._reader.query or self._reader.is_stale:
                    self._reader = StateReader(self._sim.world, plan.query)
                self._begin(request, plan)  # from here on only a user's controller can fail
            except (ControlError, UnknownName) as error:
                return self._answer(status_message=f"StepWorld: {error}")
            self._advance(request.ticks, plan.commanded, request.joint_commands)
            try:
                state = self._reader.read(self._knows_contacts)
            except UnknownName as error:
                fault = f"StepWorld: the ticks are done, but meanwhile {error}"
                return self._answer(status_message=fault)
            models = state.models.values()
            return self._answer(
                success=True,
                model_names=list(state.models),
                model_poses=[to_pose_msg(pose) for pose, _ in models],
                model_twists=[to_twist_msg(twist) for _, twist in models],
                link_poses=[to_pose_msg(pose) for pose, _ in state.links],
                link_twists=[to_twist_msg(twist) for _, twist in state.links],
                contacts=[to_contact_state(pair) for pair in state.contacts],
            )

    def _addresses(self) -> Addresses:
        """Returns what names stand for now."""
        if self._current.version != self._sim.version:
            self._current = Addresses(self._sim)
        return self._current

    def _begin(self, request: srv.StepWorldRequest, plan: StepPlan) -> None:
        sim = self._sim
        if request.reset != srv.StepWorldRequest.NONE or plan.placed_models or plan.placed_joints:
            self._knows_contacts = False
            with sim.moves.as_one():
                self._place(request, plan)
        plan.commanded.send(list(request.commands))
        plan.commanded.hold(request.joint_commands)

    def _place(self, request: srv.StepWorldRequest, plan: StepPlan) -> None:
        sim = self._sim
        if request.reset != srv.StepWorldRequest.NONE:
            if request.seed:
                seed_random_numbers(request.seed)
                sim.reseed(request.seed)
            sim.reset(everything=request.reset == srv.StepWorldRequest.SIMULATION)
            sim.began = sim.now
        for model, pose, twist in plan.placed_models:
            sim.place_model(model, pose, twist)
        for model, (positions, velocities) in plan.placed_joints.items():
            sim.set_joint_states(model, positions, velocities)

    def _advance(self, ticks: int, commanded: Commanded, of_joints: Sequence[float]) -> None:
        """Lets time pass; the joints are commanded before each tick."""
        if not ticks:
            return
        with self._watchdog:
            while ticks > SLICE:
                self._pass(SLICE, commanded, of_joints)
                ticks -= SLICE
                self._sim.lock.yield_turn()
                self._sim.await_holds()
            self._pass(ticks, commanded, of_joints)
        self._knows_contacts = True

    def _pass(self, ticks: int, commanded: Commanded, of_joints: Sequence[float]) -> None:
        if not of_joints:
            self._sim.advance(ticks)
            return
        left = ticks

        def hold_on() -> bool:
            nonlocal left
            left -= 1
            if left:  # not after the last tick: what limits have left of a command stays
                commanded.hold(of_joints)
            return False

        commanded.hold(of_joints)
        self._sim.advance(ticks, hold_on)

    def _answer(self, **fields: object) -> srv.StepWorldResponse:
        sim, addresses = self._sim, self._addresses()
        joints = addresses.joints
        return srv.StepWorldResponse(
            sim_time=sim.sim_time,
            joint_states=JointState(
                header=Header(stamp=to_time(sim.now)),
                name=addresses.joint_names,
                position=[joint.position for joint in joints],
                velocity=[joint.velocity for joint in joints],
                effort=[joint.effort for joint in joints],
            ),
            **fields,
        )

    def _set_friction(self, request: srv.SetLinkFrictionRequest) -> str:
        with self._sim.lock:
            link = existing(self._sim.world.link(request.link_name), NO_LINK)
            try:
                set_link_friction(*link, request.factor)
            except PropertyError as error:
                raise ServiceRefused(str(error)) from error
        return "SetLinkFriction: friction set"
