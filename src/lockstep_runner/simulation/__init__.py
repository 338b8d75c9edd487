"""The simulation as a script sees it: its time, and the messages that come with it."""
