"""Trainings by Stable-Baselines3's algorithms."""
