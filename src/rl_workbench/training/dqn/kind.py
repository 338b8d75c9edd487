"""DQN by name."""

from rl_workbench.agents.dqn.settings import DQNSettings
from rl_workbench.training.options.kind import AlgorithmKind

DQN = AlgorithmKind(
    name="dqn",
    about="an agent by DQN in any Gymnasium environment with single actions",
    config="dqn.yaml",
    implementation="rl_workbench.training.dqn.algorithm",
    hyperparameters=lambda: DQNSettings,
    defaults={
        "total_timesteps": 50_000,
        "eval_frequency": 1_000,
        "confirm_episodes": 100,
        "checkpoint_frequency": 5_000,
    },
    presets=True,
)
