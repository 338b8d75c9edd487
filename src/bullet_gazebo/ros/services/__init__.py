"""The services of the node `gazebo`, a module for each group."""
