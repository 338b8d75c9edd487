"""apply_joint_effort, apply_body_wrench and what clears them (docs/contract/gazebo.md 2.18 and 2.19)."""

import genpy
import rospy
from gazebo_msgs.srv import (
    ApplyBodyWrench,
    ApplyBodyWrenchRequest,
    ApplyBodyWrenchResponse,
    ApplyJointEffort,
    ApplyJointEffortRequest,
    ApplyJointEffortResponse,
    BodyRequest,
    BodyRequestRequest,
    BodyRequestResponse,
    JointRequest,
    JointRequestRequest,
    JointRequestResponse,
)

from bullet_gazebo.applied_forces import AppliedEffort, AppliedWrench, Interval, in_world
from bullet_gazebo.ros.wire.checks import bad_number
from bullet_gazebo.ros.wire.conversions import to_vector
from bullet_gazebo.simulator import Simulator


class ForceServices:
    """Services that push joints and bodies for a time. They queue it and answer at once."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~apply_joint_effort", ApplyJointEffort, self._apply_effort),
            rospy.Service("~apply_body_wrench", ApplyBodyWrench, self._apply_wrench),
            rospy.Service("~clear_joint_forces", JointRequest, self._clear_efforts),
            rospy.Service("~clear_body_wrenches", BodyRequest, self._clear_wrenches),
        ]

    def _apply_effort(self, request: ApplyJointEffortRequest) -> ApplyJointEffortResponse:
        with self._sim.lock:
            found = self._sim.world.joint(request.joint_name)
            if found is None:
                return ApplyJointEffortResponse(False, "ApplyJointEffort: joint not found")
            fault = bad_number(request)
            if fault:
                return ApplyJointEffortResponse(False, f"ApplyJointEffort: {fault}")
            interval = self._interval(request.start_time, request.duration)
            self._sim.applied.add_effort(AppliedEffort(*found, request.effort, interval))
        return ApplyJointEffortResponse(True, "ApplyJointEffort: effort set")

    def _apply_wrench(self, request: ApplyBodyWrenchRequest) -> ApplyBodyWrenchResponse:
        with self._sim.lock:
            world = self._sim.world
            found = world.link(request.body_name)
            if found is None:
                return _not_applied("body does not exist")
            frame = world.frame(request.reference_frame)
            if frame is None:
                return _not_applied("reference_frame not found")
            fault = bad_number(request)
            if fault:
                return _not_applied(fault)
            wrench = in_world(
                (to_vector(request.wrench.force), to_vector(request.wrench.torque)),
                to_vector(request.reference_point),
                found[0].link_state(found[1])[0],
                None if world.is_world_frame(request.reference_frame) else frame[0],
            )
            interval = self._interval(request.start_time, request.duration)
            self._sim.applied.add_wrench(AppliedWrench(*found, wrench, interval))
        return ApplyBodyWrenchResponse(True, "")

    def _interval(self, start: genpy.Time, duration: genpy.Duration) -> Interval:
        """A start in the past is now."""
        return Interval(max(start.to_nsec(), self._sim.now), duration.to_nsec())

    def _clear_efforts(self, request: JointRequestRequest) -> JointRequestResponse:
        with self._sim.lock:
            self._sim.applied.clear_efforts(request.joint_name)
        return JointRequestResponse()

    def _clear_wrenches(self, request: BodyRequestRequest) -> BodyRequestResponse:
        with self._sim.lock:
            self._sim.applied.clear_wrenches(request.body_name)
        return BodyRequestResponse()


def _not_applied(fault: str) -> ApplyBodyWrenchResponse:
    return ApplyBodyWrenchResponse(False, f"ApplyBodyWrench: {fault}")
