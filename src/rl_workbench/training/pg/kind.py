"""The policy gradients by name."""

from dataclasses import dataclass

from rl_workbench.agents.pg.settings import DocumentSettings, ReinforceSettings
from rl_workbench.option import option
from rl_workbench.training.options.kind import AlgorithmKind


@dataclass(frozen=True)
class ReinforceOptions(ReinforceSettings):
    """The agent's, and the training's own."""

    save_every: int = option(
        100, "episodes between saves of the networks as .pth; 0: at the end only", 0, 2**31 - 1
    )


@dataclass(frozen=True)
class DocumentOptions(DocumentSettings):
    """The agent's, and the training's own."""

    save_every: int = option(
        100, "episodes between saves of the networks as .pth; 0: at the end only", 0, 2**31 - 1
    )


_EPISODIC = {"episodes": 600, "eval_frequency": 0, "eval_episodes": 20}

REINFORCE = AlgorithmKind(
    name="reinforce",
    about="a policy by REINFORCE with a fitted baseline and generalised advantages\n"
    "in any Gymnasium environment with single or continuous actions",
    config="pg.yaml",
    implementation="rl_workbench.training.pg.making",
    hyperparameters=lambda: ReinforceOptions,
    learns_in_several=True,
    defaults={**_EPISODIC, "normalize_observations": True},
)
REINFORCE_DOCUMENT = AlgorithmKind(
    name="reinforce-document",
    about="a linear policy by the algorithm of the ROS policy-gradient document,\n"
    "in an environment with 4 observations and 2 actions",
    config="pg.yaml",
    section="reinforce-document {env_id}",
    implementation="rl_workbench.training.pg.making",
    hyperparameters=lambda: DocumentOptions,
    defaults=_EPISODIC,
)
