"""Services of a world in lock-step: steps with commands, and time for scripts with their messages."""
