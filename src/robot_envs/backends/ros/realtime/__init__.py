"""A robot whose time runs by itself, moved by Gazebo's own services and topics alone."""
