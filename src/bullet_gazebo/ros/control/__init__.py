"""gazebo_ros_control: the plugin, the controller manager's services, controllers' topics."""
