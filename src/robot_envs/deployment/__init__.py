"""A task and a policy on a robot over ROS: what is known of it, what it is commanded, and their node."""
