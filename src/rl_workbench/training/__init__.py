"""Running agents in environments: the loop, what it writes, and the command line."""
