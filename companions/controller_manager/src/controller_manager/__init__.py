"""Python names of ros_control's package controller_manager."""
