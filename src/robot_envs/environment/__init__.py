"""Gymnasium's side: the environment, its spaces and goals, and what a task is and returns, checked."""
