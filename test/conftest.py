"""What all tests share: rostest files as test items, fixtures, and skips where an extra is missing."""

from __future__ import annotations

import importlib.util
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from support.plugins import stress_plugin
from support.plugins.rostest_plugin import pytest_collect_file
from support.plugins.stress_plugin import (
    pytest_addoption,
    pytest_report_header,
    pytest_terminal_summary,
    scenario,
)

__all__ = [
    "pytest_addoption",
    "pytest_collect_file",
    "pytest_report_header",
    "pytest_terminal_summary",
    "scenario",
]

# Nodes of rostest files: only roslaunch can run them.
collect_ignore_glob = ["ros/**/*.py"]

ROOT = Path(__file__).resolve().parent.parent


# Such small networks only lose by more threads: on a busy machine seconds become a minute.
os.environ.setdefault("OMP_NUM_THREADS", "1")

settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")

# nohup ignores SIGHUP and a script's background job SIGINT, and so would whatever a test starts.
# Run the tests as if from a terminal.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ENGINES = ["ode", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))]


@pytest.fixture
def other_master() -> Iterator[Any]:
    """A `FakeMaster`: answers as a ROS master and as a node, without ROS's servers."""
    from support.ros.ros_fakes import FakeMaster

    fake = FakeMaster()
    yield fake
    fake.close()


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A `FakeMaster` that ROS_MASTER_URI names."""
    from support.ros.ros_fakes import FakeMaster

    fake = FakeMaster()
    monkeypatch.setenv("ROS_MASTER_URI", fake.uri)
    yield fake
    fake.close()


@pytest.fixture
def nobody_listens() -> Iterator[str]:
    """An address that refuses connections, as that of a master that has ended."""
    with socket.socket() as reserved:
        reserved.bind(("127.0.0.1", 0))
        yield f"http://127.0.0.1:{reserved.getsockname()[1]}"


@pytest.fixture
def nobody_answers() -> Iterator[str]:
    """An address that takes connections, and no more."""
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        yield f"http://127.0.0.1:{deaf.getsockname()[1]}"


@pytest.fixture(params=ENGINES)
def new_engine(request: pytest.FixtureRequest) -> Callable:
    """Make a physics engine; a test with this fixture runs once for each of them."""
    from robot_sim.physics.engines import make_engine

    return partial(make_engine, request.param)


TAKEN = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU)  # by commands
HANDLERS = {number: signal.getsignal(number) for number in TAKEN}


@pytest.fixture(autouse=True)
def signals() -> Iterator[None]:
    """Restores the signal handlers after a command that replaces them, also in a module's fixture."""
    yield
    for number, handler in HANDLERS.items():
        signal.signal(number, handler)


@pytest.fixture
def server() -> Iterator[Any]:
    """An empty viser page."""
    import viser  # most tests have none

    server = viser.ViserServer("127.0.0.1", 0, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository's root."""
    return ROOT


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test whose extra packages are missing; `ws test` installs them, but for --fast."""
    wanted = {name for marker in item.iter_markers("extras") for name in marker.args}
    missing = sorted(name for name in wanted if importlib.util.find_spec(name) is None)
    if missing:
        pytest.skip(f"{', '.join(missing)} missing: ./ws extras installs requirements/extras.txt")


def pytest_runtest_teardown(item: pytest.Item) -> None:
    """A test that makes this process a ROS node would change what all later tests see."""
    core = sys.modules.get("rospy.core")
    assert core is None or not core.is_initialized(), f"{item.nodeid} made this process a node"


@pytest.hookimpl(trylast=True)  # the reporter has to be there
def pytest_configure(config: pytest.Config) -> None:
    stress_plugin.prepare(config)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long files first: the last ones that run beside each other are short. Those over ROS, which wait half
    of their time, are spread among those that compute."""
    stress_plugin.deselect_full(config, items)
    place: dict[Path, float] = {}
    for kind in ("slow", "rostest"):
        files = list(dict.fromkeys(item.path for item in items if item.get_closest_marker(kind)))
        place |= {path: index / len(files) for index, path in enumerate(files)}
    items.sort(key=lambda item: place.get(item.path, 1.0))
