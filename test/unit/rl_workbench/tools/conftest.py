"""What several tests of the tools use."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from support.training import workbench_runs


@pytest.fixture(scope="session")
def robot_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short training of the cart-pole; not to be changed."""
    folder = tmp_path_factory.mktemp("runs") / "robot"
    workbench_runs.dqn(folder, env_id="cartpole/Classic-v0", total_timesteps=200)
    return folder


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run a command that fails; return the one line that it says."""

    def said(*words: object) -> str:
        capsys.readouterr()
        assert workbench_runs.work(*words) == 1
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert re.match("rl-workbench( train)?: ", line)
        return line

    return said
