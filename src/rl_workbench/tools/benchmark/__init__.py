"""Several trainings, and what they come to."""
