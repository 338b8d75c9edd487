"""What a process's environments over ROS share: master, simulator, robots, windows."""

from robot_envs.backends.ros.session.session import RosSession, running_session

__all__ = ["RosSession", "running_session"]
