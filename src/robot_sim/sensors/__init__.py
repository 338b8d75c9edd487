"""What measures the world: clock, noise, rays, and what each kind of sensor reports. No ROS."""
