"""The subcommands of workbench.py: flags, and what they call."""
