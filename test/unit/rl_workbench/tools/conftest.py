"""What several tests of the tools use."""

from pathlib import Path

import pytest
from support.training import workbench_runs


@pytest.fixture(scope="module")
def robot_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short training of the cart-pole."""
    folder = tmp_path_factory.mktemp("runs") / "robot"
    workbench_runs.dqn(folder, env_id="cartpole/Classic-v0", total_timesteps=200)
    return folder
