"""Between the messages of ROS and what backends know."""
