"""Joints, and forces on joints and links (docs/contract/gazebo.md 2.10 and 2.16 to 2.19)."""

import math

import genpy
import rospy
from gazebo_msgs import srv

from bullet_gazebo.common.messages import to_vector
from bullet_gazebo.services import NO_MODEL, ServiceRefused, check_message, existing, offer
from robot_sim.applied_forces import ActingTime, AppliedEffort, AppliedWrench, in_world
from robot_sim.physics.files.elements import shown
from robot_sim.physics.properties import JointProperties, PropertyError, set_joint_properties
from robot_sim.simulator import Simulator

NO_JOINT = "joint not found"
BEYOND = 0.01  # [rad, m] of a stop, as a moving joint may be
INFINITE = 1.7e308  # ODE's users write 1e16 and beyond for a joint without stops


class JointServices:
    """Services that read, change and place joints."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            offer("~get_joint_properties", srv.GetJointProperties, self._get_properties),
            offer("~set_joint_properties", srv.SetJointProperties, self._set_properties),
            offer("~set_model_configuration", srv.SetModelConfiguration, self._set_configuration),
        ]

    def _get_properties(self, request: srv.GetJointPropertiesRequest) -> srv.GetJointPropertiesResponse:
        with self._sim.lock.glance():
            model, name = existing(self._sim.world.joint(request.joint_name), NO_JOINT)
            position, rate = model.joint_state(name)
        # Gazebo answers REVOLUTE and no damping whatever the joint is.
        return srv.GetJointPropertiesResponse(
            type=srv.GetJointPropertiesResponse.REVOLUTE,
            position=[position],
            rate=[rate],
            success=True,
            status_message="GetJointProperties: got properties",
        )

    def _set_properties(self, request: srv.SetJointPropertiesRequest) -> str:
        with self._sim.lock:
            joint = existing(self._sim.world.joint(request.joint_name), NO_JOINT)
            ode = request.ode_joint_config
            check_message(ode, INFINITE)
            # Element i is for axis i, and no joint here has a second one. An empty list changes nothing.
            # The other fields (erp, cfm, stop_erp, stop_cfm, fudge_factor) have no getter and no effect.
            wanted = JointProperties(
                *(
                    next(iter(values), None)
                    for values in (ode.damping, ode.loStop, ode.hiStop, ode.fmax, ode.vel)
                )
            )
            try:
                set_joint_properties(*joint, wanted, self._sim.world.time_step)
            except PropertyError as error:
                raise ServiceRefused(str(error)) from error
        return "SetJointProperties: properties set"

    def _set_configuration(self, request: srv.SetModelConfigurationRequest) -> str:
        names, positions = request.joint_names, request.joint_positions
        with self._sim.lock:
            model = existing(self._sim.world.model(request.model_name), NO_MODEL)
            if len(names) != len(positions):
                raise ServiceRefused("joint name and position list have different lengths")
            if not all(math.isfinite(position) for position in positions):
                raise ServiceRefused(f"joint positions must be finite, not {list(positions)}")
            plain = [name.removeprefix(f"{model.name}::") for name in names]
            wanted = dict(zip(plain, positions, strict=True))
            self._sim.set_joint_states(model, wanted)
            for name in wanted.keys() & set(model.joint_names):
                stop = model.clamped(name, wanted[name])
                if abs(stop - wanted[name]) > BEYOND:
                    rospy.logwarn(
                        "SetModelConfiguration: joint '%s' of '%s' can't be at %g: it is at its stop, %g",
                        name, model.name, wanted[name], stop,
                    )  # fmt: skip
        unknown = sorted(set(plain) - set(model.joint_names))
        if unknown:  # Gazebo ignores them silently
            names = shown(", ".join(unknown))
            rospy.logwarn("SetModelConfiguration: model '%s' has no joint %s", model.name, names)
        return "SetModelConfiguration: success"


class ForceServices:
    """Services that push joints and links for a time. They queue the force and answer at once."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            offer("~apply_joint_effort", srv.ApplyJointEffort, self._apply_effort),
            offer("~apply_body_wrench", srv.ApplyBodyWrench, self._apply_wrench),
            rospy.Service("~clear_joint_forces", srv.JointRequest, self._clear_efforts),
            rospy.Service("~clear_body_wrenches", srv.BodyRequest, self._clear_wrenches),
        ]

    def _apply_effort(self, request: srv.ApplyJointEffortRequest) -> str:
        with self._sim.lock:
            joint = existing(self._sim.world.joint(request.joint_name), NO_JOINT)
            check_message(request)
            interval = self._interval(request.start_time, request.duration)
            self._sim.applied.efforts.append(AppliedEffort(*joint, request.effort, interval))
        return "ApplyJointEffort: effort set"

    def _apply_wrench(self, request: srv.ApplyBodyWrenchRequest) -> str:
        with self._sim.lock:
            world = self._sim.world
            link = existing(world.link(request.body_name), "body does not exist")
            frame = existing(world.frame(request.reference_frame), "reference_frame not found")
            check_message(request)
            wrench = in_world(
                (to_vector(request.wrench.force), to_vector(request.wrench.torque)),
                to_vector(request.reference_point),
                link[0].link_state(link[1])[0],
                None if world.is_world_frame(request.reference_frame) else frame[0],
            )
            interval = self._interval(request.start_time, request.duration)
            self._sim.applied.wrenches.append(AppliedWrench(*link, wrench, interval))
        return ""

    def _interval(self, start: genpy.Time, duration: genpy.Duration) -> ActingTime:
        """Returns when a force acts; a start in the past means now."""
        return ActingTime(max(start.to_nsec(), self._sim.now), duration.to_nsec())

    def _clear_efforts(self, request: srv.JointRequestRequest) -> srv.JointRequestResponse:
        with self._sim.lock:
            self._sim.applied.clear_efforts(request.joint_name)
        return srv.JointRequestResponse()

    def _clear_wrenches(self, request: srv.BodyRequestRequest) -> srv.BodyRequestResponse:
        with self._sim.lock:
            self._sim.applied.clear_wrenches(request.body_name)
        return srv.BodyRequestResponse()
