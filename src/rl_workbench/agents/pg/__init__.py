"""Learning from whole episodes by policy gradient."""
