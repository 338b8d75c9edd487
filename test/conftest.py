"""What all tests share: rostest files as test items, progress, and the extras that a test asks for."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from support.plugins import progress_plugin, stress_plugin
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


# Networks this small only lose by more threads: on a busy machine a test of seconds takes a minute.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# Under nohup a closed terminal is ignored, and in a script's background Ctrl-C, by whatever a test starts,
# too; the tests are as from a terminal.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ENGINES = ["ode", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))]


@pytest.fixture
def other_master() -> Iterator[Any]:
    """What answers as a ROS master does, and as a node, without ROS's servers: a `FakeMaster`."""
    from support.ros.ros_fakes import FakeMaster

    fake = FakeMaster()
    yield fake
    fake.close()


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Another one, which is this process's."""
    from support.ros.ros_fakes import FakeMaster

    fake = FakeMaster()
    monkeypatch.setenv("ROS_MASTER_URI", fake.uri)
    yield fake
    fake.close()


@pytest.fixture(params=ENGINES)
def new_engine(request: pytest.FixtureRequest) -> Callable:
    """Makes a physics engine; a test that asks for it runs with each of them."""
    from bullet_gazebo.physics.engines import make_engine

    return partial(make_engine, request.param)


@pytest.fixture
def signals() -> Iterator[None]:
    """Gives signals back after a command that takes them over, as if in a process of its own."""
    taken = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU)
    before = {number: signal.getsignal(number) for number in taken}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def server() -> Iterator[Any]:
    """A page of viser's, an empty one."""
    import viser  # most tests have none

    server = viser.ViserServer("127.0.0.1", 0, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository's root."""
    return ROOT


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Install the extra packages once a selected test needs them; ws says so on stderr."""
    wanted = [name for marker in item.iter_markers("extras") for name in marker.args]
    if all(importlib.util.find_spec(name) for name in wanted):
        return
    subprocess.run([ROOT / "ws", "extras"], check=True)
    importlib.invalidate_caches()


def pytest_runtest_teardown(item: pytest.Item) -> None:
    """A test that makes its process a node changes what all later ones see: it takes another one."""
    core = sys.modules.get("rospy.core")
    assert core is None or not core.is_initialized(), f"{item.nodeid} made this process a node"


@pytest.hookimpl(trylast=True)  # the reporter has to be there
def pytest_configure(config: pytest.Config) -> None:
    progress_plugin.pytest_configure(config)
    stress_plugin.prepare(config)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    stress_plugin.deselect_full(config, items)
