"""Agents, their training, and what is done with trainings, for any environment of Gymnasium's."""
