"""Trainings: one frame for all algorithms, and an adapter for each."""
