"""What moves a robot: this process's own physics, or a simulator over ROS, in lock-step or in real time.

Of this package only these modules import rospy, and only those that a backend over ROS needs:
`in_process.py` and `choice.py` work where no ROS is installed.
"""
