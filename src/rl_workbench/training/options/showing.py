"""How a training is shown: no setting of it, so it is recorded nowhere and may differ when it goes on."""

from dataclasses import dataclass

from rl_workbench.option import option


@dataclass(frozen=True)
class ShowingOptions:
    """What is seen of it beside the terminal."""

    gui: bool = option(
        False, "show it on a page in the browser: its curves, and episodes of its newest checkpoint"
    )
