"""step_world: resets, commands and moves a world in lock-step, and answers with its state."""

import threading
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager

import rospy
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest, StepWorldResponse
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.ros.services.stepping.step_requests import StepPlan
from bullet_gazebo.ros.wire.conversions import to_pose_msg, to_time, to_twist_msg
from bullet_gazebo.ros.wire.seeding import seed_random_numbers
from bullet_gazebo.simulator import Simulator

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
        self._service = rospy.Service("~step_world", StepWorld, self._step)

    def _step(self, request: StepWorldRequest) -> StepWorldResponse:
        with self._one_at_a_time, self._sim.lock:
            self._sim.await_holds()
            try:
                plan = StepPlan(self._sim, request)  # everything is checked before anything is done
                self._begin(request, plan)  # what is left to fail is a user's controller
            except ControlError as error:
                return self._answer(request, f"StepWorld: {error}")
            with self._watchdog:
                self._advance(request.ticks, plan.held)
            return self._answer(request)

    def _begin(self, request: StepWorldRequest, plan: StepPlan) -> None:
        sim = self._sim
        if request.reset != StepWorldRequest.NONE:
            if request.seed:
                seed_random_numbers(request.seed, tell=False)
            sim.reset(everything=request.reset == StepWorldRequest.SIMULATION)
        for model, (positions, velocities) in plan.placed.items():
            sim.set_joint_states(model, positions, velocities)
        for command in (*plan.commands, *plan.held):
            command()

    def _advance(self, ticks: int, held: Sequence[Callable[[], None]]) -> None:
        while ticks > SLICE:
            self._pass(SLICE, held)
            ticks -= SLICE
            self._sim.lock.yield_turn()
            self._sim.await_holds()
        if ticks:
            self._pass(ticks, held)

    def _pass(self, ticks: int, held: Sequence[Callable[[], None]]) -> None:
        if not held:
            self._sim.advance(ticks)
            return
        for _ in range(ticks):  # limits clip a command in place, to what one tick can do of it
            for command in held:
                command()
            self._sim.advance(1)

    def _answer(self, request: StepWorldRequest, fault: str = "") -> StepWorldResponse:
        response = StepWorldResponse(
            success=not fault,
            status_message=fault,
            sim_time=self._sim.sim_time,
            joint_states=self._joint_states(),
        )
        if request.model_states and not fault:
            self._add_models(response)
        return response

    def _joint_states(self) -> JointState:
        robots = self._sim.robots
        scoped = len(robots) > 1
        joints = [(robot, joint) for robot in robots for joint in robot.hardware.joints.values()]
        return JointState(
            header=Header(stamp=to_time(self._sim.now)),
            name=[f"{r.model.name}::{j.name}" if scoped else j.name for r, j in joints],
            position=[joint.position for _, joint in joints],
            velocity=[joint.velocity for _, joint in joints],
            effort=[joint.effort for _, joint in joints],
        )

    def _add_models(self, response: StepWorldResponse) -> None:
        for name, model in self._sim.world.models.items():
            pose, twist = model.state()
            response.model_names.append(name)
            response.model_poses.append(to_pose_msg(pose))
            response.model_twists.append(to_twist_msg(twist))
