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

from importlib import import_module
from typing import Any

__all__ = [
    "readiness",
    "ros_controllers",
    "ros_gazebo",
    "ros_launch",
    "ros_node",
    "ros_params",
    "ros_spawn",
    "ros_urdf",
    "service_client",
    "simulation",
    "step_client",
    "testing",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")
