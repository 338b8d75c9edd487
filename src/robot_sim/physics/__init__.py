"""Model descriptions and the physics world: no ROS and no controllers in here."""
