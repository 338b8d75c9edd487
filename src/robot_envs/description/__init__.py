"""What a robot's files say: found and read, and its controllers loaded as ros_control loads them."""
