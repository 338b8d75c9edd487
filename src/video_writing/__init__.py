"""Writes videos: a leaf that knows nothing of what they show."""
