"""get_light_properties, set_light_properties and delete_light (docs/contract/gazebo.md 2.6 and 2.21)."""

import rospy
from gazebo_msgs.srv import (
    DeleteLight,
    DeleteLightRequest,
    DeleteLightResponse,
    GetLightProperties,
    GetLightPropertiesRequest,
    GetLightPropertiesResponse,
    SetLightProperties,
    SetLightPropertiesRequest,
    SetLightPropertiesResponse,
)
from std_msgs.msg import ColorRGBA

from bullet_gazebo.physics.description import Color
from bullet_gazebo.ros.wire.checks import bad_number
from bullet_gazebo.ros.wire.conversions import from_pose_msg, to_vector
from bullet_gazebo.simulator import Simulator


class LightServices:
    """What a client sets is what it reads back, and what a window shows."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~get_light_properties", GetLightProperties, self._get),
            rospy.Service("~set_light_properties", SetLightProperties, self._set),
            rospy.Service("~delete_light", DeleteLight, self._delete),
        ]

    def _get(self, request: GetLightPropertiesRequest) -> GetLightPropertiesResponse:
        name = request.light_name
        with self._sim.lock:
            light = self._sim.world.lights.get(name)
            if light is None:
                text = f"getLightProperties: Requested light {name} not found!"
                return GetLightPropertiesResponse(status_message=text)
            return GetLightPropertiesResponse(
                diffuse=ColorRGBA(*light.diffuse),
                attenuation_constant=light.attenuation_constant,
                attenuation_linear=light.attenuation_linear,
                attenuation_quadratic=light.attenuation_quadratic,
                success=True,
            )

    def _set(self, request: SetLightPropertiesRequest) -> SetLightPropertiesResponse:
        name = request.light_name
        with self._sim.lock:
            light = self._sim.world.lights.get(name)
            if light is None:
                text = f"setLightProperties: Requested light {name} not found!"
                return SetLightPropertiesResponse(False, text)
            fault = bad_number(request)
            if fault:
                return SetLightPropertiesResponse(False, f"setLightProperties: {fault}")
            light.diffuse, light.specular = _color(request.diffuse), _color(request.specular)
            light.cast_shadows = request.cast_shadows
            light.attenuation_constant = request.attenuation_constant
            light.attenuation_linear = request.attenuation_linear
            light.attenuation_quadratic = request.attenuation_quadratic
            light.direction = to_vector(request.direction)
            light.pose = from_pose_msg(request.pose)
            self._sim.world.version += 1
        return SetLightPropertiesResponse(True, "")

    def _delete(self, request: DeleteLightRequest) -> DeleteLightResponse:
        name = request.light_name
        with self._sim.lock:
            light = self._sim.world.lights.pop(name, None)
            self._sim.world.version += 1
        if light is None:  # Gazebo's text for a light that doesn't exist, after 10 s
            text = f'DeleteLight: Timeout reached while removing light "{name}"'
            return DeleteLightResponse(False, text)
        return DeleteLightResponse(True, f"DeleteLight: {name} successfully deleted")


def _color(msg: ColorRGBA) -> Color:
    return (msg.r, msg.g, msg.b, msg.a)
