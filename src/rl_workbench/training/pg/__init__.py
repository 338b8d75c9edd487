"""A training by policy gradient."""
