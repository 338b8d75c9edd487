"""Python names of Gazebo's package gazebo_ros."""
