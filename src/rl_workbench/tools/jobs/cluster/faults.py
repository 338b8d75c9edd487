"""What goes wrong in a cluster, in a line."""

# What a user can make use of; Ray's own texts are pages.
LINES = {
    "NodeDiedError": "its node died",
    "WorkerCrashedError": "its worker died",
    "LocalRayletDiedError": "the raylet of its node died",
    "OutOfMemoryError": "its node had no memory left",
    "OutOfDiskError": "its node's disk is full, and so is Ray's object store",
    "ObjectStoreFullError": "the object store of its node is full",
    "ObjectLostError": "what it told was lost with its node",
    "OwnerDiedError": "what it told was lost with its node",
    "TaskCancelledError": "it was stopped",
}


def in_a_line(error: Exception) -> str:
    """An error of Ray's in a line."""
    for kind in type(error).__mro__:
        if kind.__name__ in LINES:
            return LINES[kind.__name__]
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
