"""The figures of a policy-gradient training."""

from rl_workbench.training.pg.loop import EpisodeRecord
from rl_workbench.training.run.scalar_log import ScalarLog


class PolicyFigures:
    """The observer that writes the document's tags by episode, and the field's by step."""

    def __init__(self, log: ScalarLog) -> None:
        self._log = log

    def episode_done(self, record: EpisodeRecord) -> None:
        """Writes the episode's rows; of losses only where something was learned."""
        document = {"Reward": record.total_reward}
        field = {
            "charts/episodic_return": record.total_reward,
            "charts/episodic_length": record.length,
            "charts/SPS": record.steps_per_second,
        }
        if record.losses is not None:
            document |= {"Value Loss": record.losses.value, "Policy Loss": record.losses.policy}
            field["losses/value_loss"] = record.losses.value
            field["losses/policy_loss"] = record.losses.policy
        self._log.add(record.index, document)
        self._log.add(record.steps, field)
