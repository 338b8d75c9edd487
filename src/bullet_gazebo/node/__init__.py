"""The node `gazebo`: its start and end, and what keeps it alive."""
