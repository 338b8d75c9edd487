"""On PYTHONPATH of what a script in lock-step starts: Python reads sitecustomize by itself."""
