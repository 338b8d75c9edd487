"""Model and world files: URDF, SDF, and what engines are given.

What can't be read raises DescriptionError, one line with the place and the fault; what is too large for one
model or world, or takes too long, raises LimitExceeded.
"""
