"""get_link_properties, set_link_properties and get_link_state (docs/contract/gazebo.md 2.11 to 2.13)."""

from dataclasses import replace

import rospy
from gazebo_msgs.msg import LinkState
from gazebo_msgs.srv import (
    GetLinkProperties,
    GetLinkPropertiesRequest,
    GetLinkPropertiesResponse,
    GetLinkState,
    GetLinkStateRequest,
    GetLinkStateResponse,
    SetLinkProperties,
    SetLinkPropertiesRequest,
    SetLinkPropertiesResponse,
)

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.properties import PropertyError, link_inertia, set_link_properties
from bullet_gazebo.physics.world import seen_from
from bullet_gazebo.ros.wire.checks import bad_number
from bullet_gazebo.ros.wire.conversions import to_pose_msg, to_twist_msg, to_vector
from bullet_gazebo.simulator import Simulator

TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
SCOPE = "did you forget to scope the link by model name?"


class LinkServices:
    """Services that tell and change what a link is, and tell where it is."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~get_link_properties", GetLinkProperties, self._get_properties),
            rospy.Service("~set_link_properties", SetLinkProperties, self._set_properties),
            rospy.Service("~get_link_state", GetLinkState, self._get_state),
        ]

    def _get_properties(self, request: GetLinkPropertiesRequest) -> GetLinkPropertiesResponse:
        with self._sim.lock:
            found = self._sim.world.link(request.link_name)
            if found is None:
                return GetLinkPropertiesResponse(
                    status_message=f"GetLinkProperties: link not found, {SCOPE}"
                )
            inertia, gravity = link_inertia(*found), found[0].body.link_gravity(found[1])
        return GetLinkPropertiesResponse(
            com=to_pose_msg(Pose(inertia.com.position)),  # never its orientation
            gravity_mode=gravity,
            mass=inertia.mass,
            success=True,
            status_message="GetLinkProperties: got properties",
            **{key: getattr(inertia, key) for key in TENSOR},
        )

    def _set_properties(self, request: SetLinkPropertiesRequest) -> SetLinkPropertiesResponse:
        with self._sim.lock:
            found = self._sim.world.link(request.link_name)
            if found is None:
                return _not_set(f"link not found, {SCOPE}")
            fault = bad_number(request)
            if fault:
                return _not_set(fault)
            old = link_inertia(*found)
            inertia = replace(
                old,
                mass=request.mass,
                com=old.com._replace(position=to_vector(request.com.position)),
                **{key: getattr(request, key) for key in TENSOR},
            )
            try:
                set_link_properties(self._sim.world, *found, inertia, request.gravity_mode)
            except (PropertyError, DescriptionError) as error:
                return _not_set(str(error))
        return SetLinkPropertiesResponse(True, "SetLinkProperties: properties set")

    def _get_state(self, request: GetLinkStateRequest) -> GetLinkStateResponse:
        with self._sim.lock:
            world = self._sim.world
            found = world.link(request.link_name)
            if found is None:
                return GetLinkStateResponse(status_message=f"GetLinkState: link not found, {SCOPE}")
            frame = world.frame(request.reference_frame)
            if frame is None:
                return GetLinkStateResponse(
                    status_message=f"GetLinkState: reference reference_frame not found, {SCOPE}"
                )
            pose, twist = seen_from(found[0].link_state(found[1]), frame)
        state = LinkState(
            request.link_name, to_pose_msg(pose), to_twist_msg(twist), request.reference_frame
        )
        return GetLinkStateResponse(state, True, "GetLinkState: got state")


def _not_set(fault: str) -> SetLinkPropertiesResponse:
    return SetLinkPropertiesResponse(False, f"SetLinkProperties: {fault}")
