"""Simulators of one's own: each with a master of its own, started again where it fails."""
