"""What an environment needs in a simulator's world: the world, robots with their controllers, objects."""
