"""The journal of a world in lock-step, and its replay (docs/replay.md)."""
