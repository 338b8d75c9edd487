"""Curves, panels, policies and films."""
