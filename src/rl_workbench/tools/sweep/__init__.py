"""The search for options."""
