"""Ids of environments as text: `module:namespace/Name-v0` or `namespace/Name-v0`, as Gymnasium has them."""

import re


def without_module(env_id: str) -> str:
    """The id under which it is registered."""
    return env_id.partition(":")[2] or env_id


def module_of(env_id: str) -> str:
    """The module that registers it; empty if the id names none."""
    module, colon, _ = env_id.partition(":")
    return module if colon else ""


def as_file_name(env_id: str) -> str:
    """For the names of files and folders."""
    return re.sub("[/:]", "-", env_id)
