"""What follows from a description by mechanics alone: lumping, inertias, frames, bounds."""
