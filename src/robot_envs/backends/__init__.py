"""What moves a robot: this process's own physics, or a simulator over ROS, in lock-step or in real time.

Nothing else of `robot_envs` imports rospy, and here `backend.py`, `choice.py` and `in_process.py` don't:
these work where no ROS is installed.
"""
