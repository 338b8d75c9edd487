"""`--ray` with a real cluster of two nodes on this machine; workers, nodes and the driver are killed."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from rl_workbench import cli

pytestmark = [pytest.mark.extras("ray"), pytest.mark.slow, pytest.mark.xdist_group("ray")]

# Long enough to be killed in the middle, on any machine; a checkpoint every few milliseconds.
LONG = "total_timesteps=3000"
PARAMS = ["learning_starts=50", "batch_size=8", "hidden_sizes=8",
          "eval_frequency=1000", "eval_episodes=1", "confirm_episodes=1",
          "checkpoint_frequency=100"]  # fmt: skip
QUIET = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_AUTH_MODE": "disabled"}
PATIENCE = 600.0  # [s], on a busy machine


def wait_until(condition: Callable[[], object], what: str) -> None:
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until, f"waited for {what}"
        time.sleep(0.05)


def benchmark(out: Path, *flags: str, length: str = LONG) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "rl_workbench", "benchmark", f"--out={out}", "--seeds=2",
               "--episodes=2", *flags, "--params", length, *PARAMS]  # fmt: skip
    return subprocess.Popen(
        command,
        env={**os.environ, **QUIET},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def finished(process: subprocess.Popen[str], code: int = 0) -> str:
    said, _ = process.communicate()
    assert process.returncode == code, said
    return said


def run_of(out: Path, seed: int) -> Path:
    return out / "dqn__CartPole-v1" / f"seed_{seed}"


def is_half_done(out: Path, seed: int) -> bool:
    run = run_of(out, seed)
    assert not (run / "summary.json").exists()
    return (run / "last.pt").exists()


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Iterator[bytes]:
    """Of a benchmark that nobody disturbs, without Ray."""
    out = tmp_path_factory.mktemp("undisturbed")
    finished(benchmark(out, "--jobs=2"))
    return (out / "results.md").read_bytes()


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two nodes, each with room for a job."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in QUIET.items():
            patch.setenv(name, value)
        from ray.cluster_utils import Cluster

        cluster = Cluster()
        for _ in range(2):
            cluster.add_node(wait=False, include_dashboard=False)
        yield cluster
        cluster.shutdown()


def title(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""


def workers(node: Any) -> list[psutil.Process]:
    """A node's processes that do a job."""
    raylet = psutil.Process(node.all_processes["raylet"][0].process.pid)
    return [each for each in raylet.children(True) if title(each).startswith("ray::train")]


def trainings(out: Path) -> list[psutil.Process]:
    """The processes that train into a folder."""
    words = (f"--run-dir={out}", f"--resume={out}")
    return [each for each in psutil.process_iter() if any(word in title(each) for word in words)]


def test_what_is_killed_changes_no_byte_of_the_table(cluster, table: bytes, tmp_path: Path) -> None:
    """A worker, then a whole node, then the command itself."""
    flag = f"--ray={cluster.address}"
    driver = benchmark(tmp_path, flag)
    try:
        wait_until(lambda: is_half_done(tmp_path, 0), "a training")
        first, (second,) = cluster.head_node, cluster.worker_nodes
        wait_until(lambda: workers(first), "a job on the first node")
        workers(first)[0].kill()
        wait_until(lambda: workers(second), "a job on the second node")
        cluster.remove_node(second, allow_graceful=False)
        logs = [run_of(tmp_path, seed).with_suffix(".log") for seed in range(2)]
        wait_until(lambda: any("resuming at step" in log.read_text() for log in logs), "the rest")
    finally:
        driver.kill()
    said = driver.communicate()[0]
    assert "2 nodes of a Ray cluster with 2 cores" in said
    assert "(raylet)" not in said, "Ray's own words are pages"
    wait_until(lambda: not trainings(tmp_path), "the end of its trainings")

    driver = benchmark(tmp_path, flag)
    try:
        wait_until(lambda: trainings(tmp_path), "a training")  # of this driver, that has joined
        driver.send_signal(signal.SIGINT)
        said = finished(driver, 130)
    finally:
        driver.kill()
    assert "interrupted; run the same command again" in said
    wait_until(lambda: not trainings(tmp_path), "the end of its trainings")

    finished(benchmark(tmp_path, flag))
    assert (tmp_path / "results.md").read_bytes() == table


def test_a_node_that_does_not_see_the_folder_is_one_line(cluster, tmp_path, monkeypatch) -> None:
    (tmp_path / "a").mkdir()
    program = (
        "from rl_workbench.tools import ray_tasks\n"
        "from rl_workbench.cli import main\n"
        "ray_tasks.TOKEN = '.another'\n"  # the nodes look for the real one
        "import sys; sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", program, "benchmark", f"--ray={cluster.address}", "--seeds=1",
               f"--out={tmp_path / 'a'}"]  # fmt: skip
    driver = subprocess.Popen(
        command, env={**os.environ, **QUIET}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )  # fmt: skip
    assert f"doesn't see {tmp_path / 'a'}: --out must be a folder that all" in finished(driver, 1)


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("127.0.0.1:1", "no Ray cluster answers at 127.0.0.1:1: Connection refused"),
        ("nowhere", "--ray is the HOST:PORT of a cluster's head"),
        ("http://a:1", "--ray is the HOST:PORT of a cluster's head"),
        ("127.0.0.1:70000", "no Ray cluster answers"),
    ],
)
def test_where_no_cluster_is(tmp_path: Path, capsys, address: str, words: str) -> None:
    assert cli.main(["benchmark", f"--out={tmp_path}", "--seeds=1", f"--ray={address}"]) == 1
    assert words in capsys.readouterr().err


def test_a_cluster_of_this_machine_alone(tmp_path: Path) -> None:
    said = finished(benchmark(tmp_path, "--ray=local", "--seeds=1", length="total_timesteps=300"))
    assert "1 node of a Ray cluster" in said
    assert (tmp_path / "results.md").is_file()
