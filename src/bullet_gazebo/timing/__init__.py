"""Parts of the simulator's timing: who has the world, when the next tick is due, what acts for a time."""
