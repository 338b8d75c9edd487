"""Trainings whose rollouts are played on a cluster of three nodes, of which some are killed."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from support.training.pool_here import PoolHere
from support.training.ray_nodes import RayCluster, in_session, title, wait_until
from support.training.training_runs import (
    assert_same,
    assert_same_run,
    checkpoint,
    flags,
    options_of,
    run,
)

from rl_workbench.training.algorithms import recorded_kind
from rl_workbench.training.options.training_options import choose

pytestmark = [pytest.mark.extras("ray", "stable_baselines3"), pytest.mark.slow]
TESTS = Path(__file__).resolve().parents[4]
PATIENCE = 120.0  # [s], on a busy machine
GATED = "support.training.gated:Gated-v0"


@pytest.fixture(scope="module")
def cluster() -> Iterator[RayCluster]:
    made = RayCluster()
    try:
        logs = [node.folder / "node.log" for node in (*made.nodes, made.add(), made.add())]
        wait_until(lambda: all("runtime started" in log.read_text() for log in logs), "three nodes")
        yield made
    finally:
        made.close()


class Driver:
    """`train` in a process of its own.

    Args:
        arguments: of the command.
        log: where its output goes.
    """

    def __init__(self, arguments: Sequence[str], log: Path) -> None:
        path = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
        self.log = log
        with log.open("ab") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "rl_workbench", "train", *arguments],
                env={**os.environ, "PYTHONPATH": path, "RAY_AUTH_MODE": "disabled"},
                stdout=output,
                stderr=output,
                start_new_session=True,
            )

    def at_gate(self, gate: Path, count: int) -> list[int]:
        """The processes of all environments, once they wait there."""

        def waiting() -> list[int]:
            assert self.process.poll() is None, self.log.read_text()
            return [int(path.suffix[1:]) for path in gate.parent.glob(f"{gate.name}.*")]

        wait_until(lambda: len(waiting()) == count, f"{count} environments at {gate}", PATIENCE)
        return waiting()

    def kill(self) -> None:
        for pid in in_session(self.process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[Sequence[str]], Driver]]:
    """Starts drivers, none of which outlives its test."""
    with contextlib.ExitStack() as ending:

        def started(arguments: Sequence[str]) -> Driver:
            driver = Driver(arguments, tmp_path / "log")
            ending.callback(driver.kill)
            return driver

        yield started


def workers(cluster: RayCluster) -> list[int]:
    """The processes of workers, wherever they are."""
    pids = [pid for node in cluster.nodes for pid in in_session(node.process.pid)]
    return [pid for pid in pids if "ray::Worker" in title(pid)]


def is_gone(pid: int) -> bool:
    try:
        return " Z " in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return True


def test_episodes_come_to_the_same_bits_whoever_is_lost(
    cluster: RayCluster, start: Callable[..., Driver], tmp_path: Path
) -> None:
    options = {"env_id": GATED, "env_kwargs": f"gates={tmp_path}", "num_envs": 3, "episodes": 45,
               "batch_episodes": 2, "value_epochs": 2, "eval_frequency": 0, "eval_episodes": 2}  # fmt: skip
    elsewhere, gates = tmp_path / "elsewhere", [tmp_path / "4", tmp_path / "9"]
    for gate in gates:
        gate.touch()
    given = [
        "--algo",
        "reinforce",
        f"--run-dir={elsewhere}",
        f"--ray={cluster.address}",
        *flags(options),
    ]
    driver = start(given)
    at_gate = driver.at_gate(gates[0], 3)
    beside = [
        [pid for pid in in_session(node.process.pid) if pid in at_gate] for node in cluster.nodes
    ]
    assert list(map(len, beside)) == [1, 1, 1], "each has a node of its own"
    os.kill(*beside[1], signal.SIGKILL)
    cluster.nodes[2].kill()
    gates[0].unlink()
    driver.at_gate(gates[1], 1)  # new processes count from 1 again
    playing = workers(cluster)
    assert len(playing) == 3
    driver.kill()
    wait_until(lambda: all(map(is_gone, playing)), "the workers to end", PATIENCE)
    gates[1].unlink()
    told = driver.log.read_text()
    assert told.count(": another one plays its part again") >= 2, told
    assert "Traceback" not in told and "raylet" not in told, told
    run(choose(recorded_kind(elsewhere), ["--resume", str(elsewhere)]), elsewhere)
    here = run(options_of("reinforce", options), tmp_path / "here")
    assert_same_run(here, elsewhere)


def test_fragments_come_to_the_same_bits_after_ctrl_c(
    cluster: RayCluster, start: Callable[..., Driver], tmp_path: Path
) -> None:
    gate, folder = tmp_path / "40", tmp_path / "elsewhere"
    gate.touch()
    options = {"env_id": GATED, "env_kwargs": f"gates={tmp_path}", "num_envs": 2, "n_steps": 512,
               "total_timesteps": 5120, "net_arch": "8", "batch_size": 512, "n_epochs": 2,
               "eval_frequency": 0, "eval_episodes": 2, "checkpoint_frequency": 1}  # fmt: skip
    given = ["--algo", "ppo", f"--run-dir={folder}", f"--ray={cluster.address}", *flags(options)]
    driver = start(given)
    driver.at_gate(gate, 1)
    playing = workers(cluster)
    assert len(playing) == 2
    driver.process.send_signal(signal.SIGINT)
    assert driver.process.wait(PATIENCE) == 130, driver.log.read_text()
    wait_until(lambda: all(map(is_gone, playing)), "the workers to end", PATIENCE)
    steps = [int(path.stem[5:]) for path in (folder / "checkpoints").iterdir()]
    assert 0 < max(steps) < 5120 and not any(each % 1024 for each in steps), "between rollouts"
    gate.unlink()
    going_on = choose(recorded_kind(folder), ["--resume", str(folder)])
    run(going_on._replace(make_pool=PoolHere), folder)
    here = run(options_of("ppo", options)._replace(make_pool=PoolHere), tmp_path / "here")
    for name in ("last.pt", "best.pt"):
        assert_same(checkpoint(here, name), checkpoint(folder, name), name)
