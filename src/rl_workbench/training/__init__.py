"""Trainings: one loop for all algorithms, and an adapter for each."""
