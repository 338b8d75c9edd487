"""step_world: resets, commands and moves a world in lock-step, and answers with its state."""

import threading
from contextlib import AbstractContextManager

from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest, StepWorldResponse

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.ros.common.node_process import seed_random_numbers
from bullet_gazebo.ros.common.rospy_polling import PolledService
from bullet_gazebo.ros.services.stepping.addresses import Addresses
from bullet_gazebo.ros.services.stepping.answers import JointsAnswer, fields_of
from bullet_gazebo.ros.services.stepping.step_requests import StepPlan
from bullet_gazebo.ros.services.stepping.usual_requests import UsualRequests
from bullet_gazebo.simulator import Simulator
from bullet_gazebo.state import NOTHING, StateQuery, StateReader, UnknownName

SLICE = 500  # ticks between which other services get their turn


class StepService:
    """One call: reset, commands, exactly n ticks, state; in lock-step only (bullet_gazebo_msgs/StepWorld)."""

    def __init__(
        self,
        sim: Simulator,
        watchdog: AbstractContextManager[object],
        one_at_a_time: threading.Lock,
    ) -> None:
        """A fault in a block of `watchdog` ends the node; with `one_at_a_time`, nobody else's ticks come
        within a request's.
        """
        self._sim = sim
        self._watchdog = watchdog
        self._one_at_a_time = one_at_a_time
        self._reader = StateReader(sim.world, NOTHING)
        self._addresses = Addresses(sim)
        self._knows_contacts = False  # the last tick's, which a reset or a placing makes void
        self._service = PolledService("~step_world", StepWorld, self._step, UsualRequests)

    def _step(self, request: StepWorldRequest) -> StepWorldResponse:
        with self._one_at_a_time, self._sim.lock:
            self._sim.await_holds()
            try:
                # Everything is checked before anything is done.
                plan = StepPlan(self._sim, request, self._found())
                reader = self._reader_of(plan.query)
                self._begin(request, plan)  # what is left to fail is a user's controller
            except (ControlError, UnknownName) as error:
                return self._refusal(str(error))
            with self._watchdog:
                self._advance(request.ticks, plan)
            if request.ticks:
                self._knows_contacts = True
            try:
                return self._answer(reader, self._knows_contacts)
            except UnknownName as error:
                return self._refusal(f"the ticks are done, but meanwhile {error}")

    def _found(self) -> Addresses:
        """What names stand for now; clients send the same again and again."""
        if self._addresses.is_stale:
            self._addresses = Addresses(self._sim)
        return self._addresses

    def _reader_of(self, query: StateQuery) -> StateReader | None:
        """Clients ask the same again and again, so the names are looked up but once."""
        if query is NOTHING:
            return None
        if query != self._reader.query or self._reader.is_stale:
            self._reader = StateReader(self._sim.world, query)
        return self._reader

    def _begin(self, request: StepWorldRequest, plan: StepPlan) -> None:
        sim = self._sim
        if request.reset != StepWorldRequest.NONE or plan.placed_models or plan.placed:
            self._knows_contacts = False
        if request.reset != StepWorldRequest.NONE:
            if request.seed:
                seed_random_numbers(request.seed, tell=False)
            sim.reset(everything=request.reset == StepWorldRequest.SIMULATION)
        for model, pose, twist in plan.placed_models:
            sim.place_model(model, pose, twist)
        for model, (positions, velocities) in plan.placed.items():
            sim.set_joint_states(model, positions, velocities)
        plan.send()
        plan.hold()

    def _advance(self, ticks: int, plan: StepPlan) -> None:
        while ticks > SLICE:
            self._pass(SLICE, plan)
            ticks -= SLICE
            self._sim.lock.yield_turn()
            self._sim.await_holds()
        if ticks:
            self._pass(ticks, plan)

    def _pass(self, ticks: int, plan: StepPlan) -> None:
        if not plan.holds:
            self._sim.advance(ticks)
            return
        left = ticks

        def hold_on() -> bool:
            nonlocal left
            left -= 1
            if left:  # not after the last tick: what limits have left of a command stays
                plan.hold()
            return False

        plan.hold()
        self._sim.advance(ticks, hold_on)

    def _answer(self, reader: StateReader | None, stepped: bool) -> StepWorldResponse:
        sim, joints = self._sim, self._found().told_joints
        if reader is None:
            return JointsAnswer(joints, sim.now)
        return StepWorldResponse(
            success=True,
            sim_time=sim.sim_time,
            joint_states=joints.message(sim.now),
            **fields_of(reader.read(stepped)),
        )

    def _refusal(self, fault: str) -> StepWorldResponse:
        return StepWorldResponse(
            status_message=f"StepWorld: {fault}",
            sim_time=self._sim.sim_time,
            joint_states=self._found().told_joints.message(self._sim.now),
        )
