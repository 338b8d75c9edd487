"""Nodes that can't do our work are left out, each with a line that says why."""

from typing import Any

import pytest
from support.training.fake_ray import FakeRay, RayError

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.cluster import joining
from rl_workbench.training.cluster.nodes import Cluster, _looking
from rl_workbench.training.cluster.package import LIBRARIES, own_packages, versions

OURS = versions(own_packages())


def without(name: str) -> dict[str, str]:
    return {each: its for each, its in OURS.items() if each != name}


@pytest.mark.parametrize(
    ("answer", "line"),
    [
        ({}, "Python finds no package rl_workbench there; what is installed here has to be there, too"),
        (OURS | {"our package": "0123456789ab"},
         f"its our package is 0123456789ab, here it is {OURS['our package']}"),
        (OURS | {"numpy": "1.24.2"}, f"its numpy is 1.24.2, here it is {OURS['numpy']}"),
        (without("torch"), f"its torch is none, here it is {OURS['torch']}"),
        (RayError("The worker died\n\n  Traceback ...\n  ImportError: no module\n"),
         "it couldn't be asked: ImportError: no module"),
        (RayError(), "it couldn't be asked: RayError"),
    ],
)  # fmt: skip
def test_one_that_differs_is_left_out(answer: Any, line: str) -> None:
    said: list[str] = []
    cluster = Cluster(FakeRay({"a1b2c3": answer, "other": OURS}), said.append)
    for _ in range(2):
        cluster.update()
    assert said == [f"node 10.0.0.7 (a1b2) is left out: {line}"], "once"
    assert list(cluster.nodes) == ["other"] and cluster.cpus == 2
    assert cluster.placement() == {"label_selector": {"ray.io/node-id": "in(other)"}}


def test_one_that_answers_late_is_asked_once_and_one_that_is_gone_is_forgotten() -> None:
    ray = FakeRay({"late": None, "here": OURS})
    cluster = Cluster(ray, pytest.fail)
    cluster.update()
    assert list(cluster.nodes) == ["here"]
    ray.answers["late"] = OURS
    cluster.update()
    assert list(cluster.nodes) == ["here", "late"] and ray.asked == ["late", "here"]
    del ray.answers["here"]
    cluster.update()
    assert list(cluster.nodes) == ["late"]


def test_without_the_own_node_nothing_goes_on() -> None:
    ray = FakeRay({"own": OURS, "other": OURS})
    cluster = Cluster(ray, pytest.fail, "own")
    cluster.update()
    del ray.answers["own"]
    with pytest.raises(WorkbenchError, match="the node of this machine has left the cluster"):
        cluster.update()


def test_what_a_node_is_asked_tells_of_this_one() -> None:
    assert _looking()(own_packages()) == OURS
    assert set(OURS) == {"our package", *LIBRARIES}
    assert versions(own_packages()[1:])["our package"] != OURS["our package"]


def test_a_cluster_none_of_whose_nodes_can_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joining, "_found", lambda *_: FakeRay({"a1b2c3": {}}))
    monkeypatch.setattr(joining, "need", lambda *_: None)
    said: list[str] = []
    with (
        pytest.raises(
            WorkbenchError, match="^no node of the cluster at 10.0.0.1:6379 can be used$"
        ),
        joining.joined("10.0.0.1:6379", "", said.append),
    ):
        pytest.fail("it was entered")
    assert len(said) == 1


@pytest.mark.extras("ray")
def test_another_version_of_ray_or_python_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray compares them itself as it joins; what it says is folded into a line."""
    import ray

    def differ(**_: Any) -> None:
        raise RuntimeError(
            "Version mismatch: The cluster was started with:\n    Ray: 2.9.0\n    Python: 3.10.1\n"
            "This process on node 10.0.0.2 was started with:\n    Ray: 2.60.0\n    Python: 3.11.2\n"
        )

    monkeypatch.setattr(ray, "init", differ)
    monkeypatch.setattr(joining, "check_address", lambda address: None)
    monkeypatch.setattr(joining, "check_head", lambda address: None)
    with (
        pytest.raises(WorkbenchError) as raised,
        joining.joined("10.0.0.1:6379", "", pytest.fail),
    ):
        pytest.fail("it was entered")
    assert str(raised.value) == (
        "can't join the Ray cluster at 10.0.0.1:6379: Version mismatch: The cluster was started with: "
        "Ray: 2.9.0 Python: 3.10.1 This process on node 10.0.0.2 was started with: Ray: 2.60.0 "
        "Python: 3.11.2"
    )
