"""Many environments at once, each in a world of its own, stepped together."""
