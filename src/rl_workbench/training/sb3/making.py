"""What a training with Stable-Baselines3 is made of: in environments of this process, or of workers."""

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.sb3.algorithm import SB3Training, load_policy
from rl_workbench.training.sb3.model import checked_of, make_model

__all__ = ["load_policy", "make"]


def make(options: TrainingOptions) -> SB3Training:
    """A new training; see `make_algorithm`."""
    if not options.run.total_timesteps:
        raise WorkbenchError(
            f"{options.kind.name} needs total_timesteps: its schedules depend on them"
        )
    model = make_model(options)
    return SB3Training(options, model, checked_of(model.get_env()))
