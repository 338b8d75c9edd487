"""What an action, an observation and a goal must be, and what a task returns: a line for each fault."""
