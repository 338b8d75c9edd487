"""The commands that work with trainings, a module for each, and what they share.

A command's module has `add_flags(parser)` and `run(arguments, interrupt)`. For anything a user can fix,
`run` raises a WorkbenchError, whose text is one line. Heavy libraries are imported where they are used, so
that `--help` is quick.

Public, for scripts: `runs.open_run`, `policies.load_learned`, `policies.episode_steps`,
`torchscript.open_exported`.
"""

__all__ = ["policies", "runs", "torchscript"]
