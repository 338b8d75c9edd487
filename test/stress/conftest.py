"""What several stress tests compare with."""

from collections.abc import Callable
from pathlib import Path

import pytest
from support.stress.trainings import forked, new


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Returns the run folder of a training by its name in `trainings.OPTIONS` that nothing has disturbed."""
    folder = tmp_path_factory.mktemp("whole")

    def run(name: str) -> Path:
        if not (folder / name).exists():
            with forked(new(name, folder / name / "run"), folder / name) as training:
                training.ended()
        return folder / name / "run"

    return run
