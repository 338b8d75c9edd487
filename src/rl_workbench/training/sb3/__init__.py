"""A training with Stable-Baselines3."""
