"""Parts of the simulator's clockwork: who has the world, when the next tick is due, what acts for a time."""
