"""Threads, locks, pools and other processes of a script (docs/lockstep.md#threads-and-other-processes)."""
