"""Jobs that a cluster loses again and again: what the user reads. The cluster is a fake."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.training.fake_ray import FakeRay, ObjectStoreFullError, RayError, WorkerCrashedError

from rl_workbench import cli
from rl_workbench.tools.jobs import runner
from rl_workbench.tools.jobs.cluster.attempt import Began
from rl_workbench.tools.jobs.cluster.nodes import RayNodes
from rl_workbench.tools.jobs.job import Ending, Job
from rl_workbench.tools.jobs.machines import CARRIED
from rl_workbench.training.cluster import joining
from rl_workbench.training.cluster.nodes import Cluster
from rl_workbench.training.cluster.package import own_packages, versions

pytestmark = pytest.mark.usefixtures("signals")
OURS = versions(own_packages())


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (WorkerCrashedError("The worker died unexpectedly.\nPages."), "its worker died"),
        (ObjectStoreFullError("Pages."), "the object store of its node is full"),
        (RayError("Pages.\nthe last line\n"), "the last line"),
    ],
)
def test_eight_attempts_without_progress_are_enough(
    error: RayError, reason: str, tmp_path: Path, monkeypatch, capsys
) -> None:
    @contextlib.contextmanager
    def joined(address: str, going_on: str) -> Iterator[Cluster]:
        cluster = Cluster(FakeRay({"a1b2c3": OURS}, [Began("a1b2c3"), error]), pytest.fail)
        cluster.update()
        yield cluster

    monkeypatch.setattr(joining, "joined", joined)
    monkeypatch.setattr(runner, "LONGEST_PAUSE", 0.0)
    command = ["benchmark", "--seeds", "1", "--out", str(tmp_path), "--ray", "10.0.0.1:6379"]
    assert cli.main(command) == 1
    said = capsys.readouterr()
    lines = (said.out + said.err).splitlines()
    assert sum(f"lost, and tried again: {reason}" in line for line in lines) == 7, lines
    given_up = f"given up after 8 attempts without progress: {reason}"
    assert sum(given_up in line for line in lines) == 1, lines
    assert not any("Pages" in line or "Traceback" in line for line in lines)
    (job,) = json.loads((tmp_path / "jobs.json").read_text())["jobs"]
    assert job["attempts"] == 8 and given_up in str(job)


def test_a_half_done_run_that_finds_no_room_in_the_store_is_tried_again(tmp_path: Path) -> None:
    cluster = Cluster(FakeRay({"a1b2c3": OURS}, full=True), pytest.fail)
    cluster.update()
    nodes = RayNodes(cluster, tmp_path, ["python3"], None, CARRIED)
    job = Job("DQN 0", tmp_path / "run", ())
    job.folder.mkdir()
    (job.folder / "last.pt").write_text("a checkpoint")
    assert nodes.start(job) == ""
    ((_, ending),) = nodes.wait(0.0, lambda *_: None)
    assert ending == Ending(
        lost=f"{job.folder} finds no room in Ray's object store: the object store of its node is full"
    )
    assert nodes.free() == 2, "it holds no core"
    nodes.close()
