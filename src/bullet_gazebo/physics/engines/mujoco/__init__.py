"""MuJoCo as physics engine."""
