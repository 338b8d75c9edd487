"""PyBullet as physics engine."""
