"""Any robot as a Gymnasium environment: in this process, or over ROS in lock-step or in real time.

A `Robot` (robot.py) says what it is made of, a `Task` (task.py) what is to be learned, a backend
(backends/) moves it, and `RobotEnv` (environment.py) puts them together. Knows no robot by name.
"""
