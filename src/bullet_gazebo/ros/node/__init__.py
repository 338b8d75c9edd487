"""The node `gazebo`: start, plugins, state topics."""
