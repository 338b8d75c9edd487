"""What is done with trainings: a module for each command, and what they share.

A command's module has `add_flags(parser)` and `run(arguments, interrupt)`. Whatever a user can mend, `run`
raises as a WorkbenchError, whose text is one line. Heavy libraries are imported where they are used, so
that `--help` is quick.

Public, for scripts: `runs.open_run`, `policies.load_learned`, `policies.episode_steps`,
`torchscript.open_exported`.
"""

__all__ = ["policies", "runs", "torchscript"]
