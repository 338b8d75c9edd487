"""Agents in torch and NumPy. They know no environment and no files."""
