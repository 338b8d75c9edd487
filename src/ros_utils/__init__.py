"""Helpers for ROS 1 clients: launch files, nodes, parameters, URDF, controllers, and a Gazebo-like
simulator.

Use the modules: ``from ros_utils import ros_gazebo, ros_node``. Each is imported when it is first used.

- `ros_launch`, `ros_node`: start and end launch files, nodes and the master.
- `ros_params`, `ros_urdf`: load parameters and robot descriptions.
- `ros_gazebo`, `ros_controllers`, `ros_spawn`: the simulator, controllers, and a whole robot in one call.
- `simulation`: a simulator with a master of its own.
- `readiness`: waits until a world can be used.
- `testing`: tests of a robot, for pytest, unittest and rostest.
- `step_client`, `service_client`: step a world in lock-step, and call any service within a time limit.

`ros_node.ros_kill_all_processes` ends the programs started here; they end at the latest when the
Python process that started them exits. No program is ever ended by its name.
"""

from typing import TYPE_CHECKING

from file_access.lazy import attach

if TYPE_CHECKING:
    from ros_utils import readiness as readiness
    from ros_utils import ros_controllers as ros_controllers
    from ros_utils import ros_gazebo as ros_gazebo
    from ros_utils import ros_launch as ros_launch
    from ros_utils import ros_node as ros_node
    from ros_utils import ros_params as ros_params
    from ros_utils import ros_spawn as ros_spawn
    from ros_utils import ros_urdf as ros_urdf
    from ros_utils import service_client as service_client
    from ros_utils import simulation as simulation
    from ros_utils import step_client as step_client
    from ros_utils import testing as testing

__getattr__, __dir__, __all__ = attach(__name__, __path__)
