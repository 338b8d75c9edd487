"""What holds for one session of a training: no setting of it, so it is recorded nowhere and may differ when
it goes on."""

from dataclasses import dataclass

from rl_workbench.option import option
from rl_workbench.training.options.ray_flag import HELP


@dataclass(frozen=True)
class SessionOptions:
    """What is seen of a training beside the terminal, and where its environments are."""

    gui: bool = option(
        False, "show it on a page in the browser: its curves, and episodes of its newest checkpoint"
    )
    ray: str = option("", f"play in its environments {HELP}")
