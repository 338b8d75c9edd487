"""Helpers that tests share, by subject: `from support.robots.cartpole import cartpole_urdf`."""
