"""Model and world files: URDF, SDF, and what engines are given."""
