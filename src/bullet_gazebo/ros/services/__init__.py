"""The services of the node `gazebo`, grouped as in docs/contract/gazebo.md."""
