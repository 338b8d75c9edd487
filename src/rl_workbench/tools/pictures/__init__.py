"""Panels of curves, policies over the state plane, and videos."""
