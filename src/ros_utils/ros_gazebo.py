"""A Gazebo-like simulator: launch, end, and the services of its node ``/gazebo``.

Every function that calls a service takes two keywords (`At`): `timeout`, the limit for the service to come
up and again for its answer [s], and `gazebo_ns`, the simulator's node, the prefix of its services' names. A
function without other results returns True if the simulator did it. Failures are logged, never raised.
Positions are in [m], orientations are quaternions; all zeros mean no rotation.
"""

from ros_utils._internal.gazebo import launch, physics, spawn, state
from ros_utils._internal.gazebo.calls import GAZEBO, TIMEOUT, At
from ros_utils._internal.gazebo.launch import *  # noqa: F403
from ros_utils._internal.gazebo.physics import *  # noqa: F403
from ros_utils._internal.gazebo.spawn import *  # noqa: F403
from ros_utils._internal.gazebo.state import *  # noqa: F403

__all__ = ["GAZEBO", "TIMEOUT", "At"]
__all__ += launch.__all__
__all__ += physics.__all__
__all__ += spawn.__all__
__all__ += state.__all__
