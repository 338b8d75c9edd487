"""What a client asks of a world in one step, and gets: over ROS and in this process through the same code."""
