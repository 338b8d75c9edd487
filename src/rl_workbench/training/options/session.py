"""What holds for one session: no setting of a training, so it is recorded nowhere and may differ when it goes
on."""

from dataclasses import dataclass

from rl_workbench.option import option


@dataclass(frozen=True)
class ClusterOptions:
    """Where a command's trainings, or the environments of one, are."""

    ray: str | None = option(
        None,
        "on a cluster of Ray's: HOST:PORT of its head, auto for the one that this machine belongs to, or "
        "local to start one on this machine alone",
        metavar="ADDRESS",
    )


@dataclass(frozen=True)
class SessionOptions:
    """What is seen of a training beside the terminal."""

    gui: bool = option(
        False, "show it on a page in the browser: its curves, and episodes of its newest checkpoint"
    )
