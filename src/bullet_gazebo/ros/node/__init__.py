"""The node `gazebo`: its start and end, time and state topics, and what keeps it alive."""
