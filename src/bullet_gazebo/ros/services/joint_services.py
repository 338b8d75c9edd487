"""Joint properties and set_model_configuration (docs/contract/gazebo.md 2.10, 2.16 and 2.17)."""

import math

import rospy
from gazebo_msgs.srv import (
    GetJointProperties,
    GetJointPropertiesRequest,
    GetJointPropertiesResponse,
    SetJointProperties,
    SetJointPropertiesRequest,
    SetJointPropertiesResponse,
    SetModelConfiguration,
    SetModelConfigurationRequest,
    SetModelConfigurationResponse,
)

from bullet_gazebo.physics.properties import JointProperties, PropertyError, set_joint_properties
from bullet_gazebo.ros.wire.checks import bad_number
from bullet_gazebo.simulator import Simulator

LONGEST_NAME = 80  # of a joint that is told in the log
MOST_NAMES = 10  # told there
INFINITE = 1.7e308  # ODE's users write stops that are none as 1e16 and beyond


class JointServices:
    """Services that read, change and place joints."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~get_joint_properties", GetJointProperties, self._get_properties),
            rospy.Service("~set_joint_properties", SetJointProperties, self._set_properties),
            rospy.Service(
                "~set_model_configuration", SetModelConfiguration, self._set_configuration
            ),
        ]

    def _get_properties(self, request: GetJointPropertiesRequest) -> GetJointPropertiesResponse:
        with self._sim.lock:
            found = self._sim.world.joint(request.joint_name)
            if found is None:
                return GetJointPropertiesResponse(
                    status_message="GetJointProperties: joint not found"
                )
            model, name = found
            position, rate = model.joint_state(name)
        # Gazebo answers REVOLUTE and no damping whatever the joint is.
        return GetJointPropertiesResponse(
            type=GetJointPropertiesResponse.REVOLUTE,
            position=[position],
            rate=[rate],
            success=True,
            status_message="GetJointProperties: got properties",
        )

    def _set_properties(self, request: SetJointPropertiesRequest) -> SetJointPropertiesResponse:
        with self._sim.lock:
            found = self._sim.world.joint(request.joint_name)
            if found is None:
                return _not_set("joint not found")
            ode = request.ode_joint_config
            fault = bad_number(ode, INFINITE)
            if fault:
                return _not_set(fault)
            # Element i is for axis i, and no joint here has a second one. An empty list changes nothing.
            # What is left out (erp, cfm, stop_erp, stop_cfm, fudge_factor) has no getter and no effect.
            wanted = JointProperties(
                *(
                    next(iter(values), None)
                    for values in (ode.damping, ode.loStop, ode.hiStop, ode.fmax, ode.vel)
                )
            )
            try:
                set_joint_properties(*found, wanted, self._sim.world.time_step)
            except PropertyError as error:
                return _not_set(str(error))
        return SetJointPropertiesResponse(True, "SetJointProperties: properties set")

    def _set_configuration(
        self, request: SetModelConfigurationRequest
    ) -> SetModelConfigurationResponse:
        names, positions = request.joint_names, request.joint_positions
        with self._sim.lock:
            model = self._sim.world.model(request.model_name)
            if model is None:
                return _not_configured("model does not exist")
            if len(names) != len(positions):
                return _not_configured("joint name and position list have different lengths")
            if not all(math.isfinite(position) for position in positions):
                return _not_configured(f"joint positions must be finite, not {list(positions)}")
            plain = [name.removeprefix(f"{model.name}::") for name in names]
            self._sim.set_joint_positions(model, dict(zip(plain, positions, strict=True)))
        _warn_of(set(plain) - set(model.joint_names), model.name)
        return SetModelConfigurationResponse(True, "SetModelConfiguration: success")


def _not_set(fault: str) -> SetJointPropertiesResponse:
    return SetJointPropertiesResponse(False, f"SetJointProperties: {fault}")


def _not_configured(fault: str) -> SetModelConfigurationResponse:
    return SetModelConfigurationResponse(False, f"SetModelConfiguration: {fault}")


def _warn_of(unknown: set[str], model: str) -> None:
    """Gazebo ignores joints that the model lacks without a word."""
    if unknown:
        names = [name[:LONGEST_NAME] for name in sorted(unknown)[:MOST_NAMES]]
        more = f" and {len(unknown) - MOST_NAMES} more" if len(unknown) > MOST_NAMES else ""
        rospy.logwarn("SetModelConfiguration: model '%s' has no joint %s%s", model, names, more)
