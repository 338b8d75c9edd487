"""get_joint_properties and set_model_configuration (contract: gazebo_api.md sections 2.10 and 2.16)."""

import math

import rospy
from gazebo_msgs.srv import (
    GetJointProperties,
    GetJointPropertiesRequest,
    GetJointPropertiesResponse,
    SetModelConfiguration,
    SetModelConfigurationRequest,
    SetModelConfigurationResponse,
)

from bullet_gazebo.simulator import Simulator


class JointServices:
    """Services that read and place joints."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~get_joint_properties", GetJointProperties, self._get_properties),
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
        unknown = sorted(set(plain) - set(model.joint_names))
        if unknown:  # Gazebo ignores them without a word
            rospy.logwarn("SetModelConfiguration: model '%s' has no joint %s", model.name, unknown)
        return SetModelConfigurationResponse(True, "SetModelConfiguration: success")


def _not_configured(fault: str) -> SetModelConfigurationResponse:
    return SetModelConfigurationResponse(False, f"SetModelConfiguration: {fault}")
