"""Deep Q-learning: networks, replay, schedules and the agent; torch and NumPy only."""
