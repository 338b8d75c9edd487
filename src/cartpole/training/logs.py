"""TensorBoard logs: the document's own tags, and the field's `charts/` tags beside them."""

from pathlib import Path

from torch.utils.tensorboard import SummaryWriter

from cartpole.training.loop import EpisodeRecord


class TensorBoardLog:
    """Writes one point for each tag and episode; the step is the episode's number.

    Args:
        folder: where the event file goes.
        settings: shown as a table under TEXT.
    """

    def __init__(self, folder: Path, settings: dict[str, object]) -> None:
        self._writer = SummaryWriter(str(folder))
        add_table(self._writer, settings)

    def episode_done(self, record: EpisodeRecord) -> None:
        points = {
            "Reward": record.total_reward,
            "Value Loss": record.losses.value,
            "Policy Loss": record.losses.policy,
            "charts/episodic_return": record.total_reward,
            "charts/episodic_length": record.length,
            "charts/SPS": record.steps_per_second,
        }
        for tag, value in points.items():
            self._writer.add_scalar(tag, value, record.index)

    def close(self) -> None:
        """Writes what is still in memory."""
        self._writer.close()


def add_table(writer: SummaryWriter, settings: dict[str, object]) -> None:
    """Shows settings as a table under TEXT."""
    rows = "\n".join(f"|{name}|{value}|" for name, value in settings.items())
    writer.add_text("hyperparameters", f"|parameter|value|\n|-|-|\n{rows}")
