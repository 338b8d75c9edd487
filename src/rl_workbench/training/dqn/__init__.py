"""A training by DQN."""
