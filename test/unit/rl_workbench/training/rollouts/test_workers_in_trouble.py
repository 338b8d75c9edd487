"""What a training says where its workers can't go on. The cluster is a fake; real ones: test_workers.py."""

from types import SimpleNamespace
from typing import Any

import pytest

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.cluster.nodes import Node

pytestmark = pytest.mark.extras("ray")
SILENT = "silent"


class Actor:
    """A worker whose every answer is the same.

    Args:
        answer: an error is raised.
    """

    def __init__(self, answer: Any) -> None:
        self.begin = self.play = self.close = SimpleNamespace(remote=lambda *_: (self, answer))


class FakeRay:
    """What workers ask of Ray, with actors that aren't anywhere.

    Args:
        answers: of one actor after the other; the last one's is that of all further ones, too.
        full: raised where something is put into the store.
    """

    def __init__(self, answers: list[Any], full: Exception | None = None) -> None:
        self._answers, self._full = answers, full
        self.now, self.speaks = 0.0, float("inf")  # [s]; when the silent ones answer
        self.made, self.killed = list[Actor](), list[Actor]()

    def start(self, *_: Any, **__: Any) -> Actor:
        self.made.append(Actor(self._answers[min(len(self.made), len(self._answers) - 1)]))
        return self.made[-1]

    def put(self, value: Any) -> Any:
        if self._full:
            raise self._full
        return value

    def wait(self, asked: list[Any], **_: Any) -> tuple[list[Any], list[Any]]:
        self.now += 1.0
        silent = [each for each in asked if each[1] == SILENT and self.now < self.speaks]
        return [each for each in asked if each not in silent], silent

    def monotonic(self) -> float:
        return self.now

    def get(self, reference: tuple[Actor, Any]) -> Any:
        if isinstance(reference[1], Exception):
            raise reference[1]
        return reference[1]

    def kill(self, actor: Actor) -> None:
        self.killed.append(actor)


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Makes workers on a fake of Ray."""
    from rl_workbench.training.rollouts import deadlines, workers

    def made(fake: FakeRay, count: int, said: list[str], cpus: int = 4) -> workers.Workers:
        node = Node("a1b2c3", "10.0.0.7 (a1b2)", cpus)
        cluster = SimpleNamespace(cpus=cpus, nodes={node.id: node}, update=lambda *_: None)
        run = SimpleNamespace(num_envs=count, env_id="CartPole-v1")
        options = SimpleNamespace(run=run, record=dict)
        monkeypatch.setattr(workers, "ray", fake)
        monkeypatch.setattr(deadlines, "time", fake)
        monkeypatch.setattr(workers.Workers, "_start", fake.start)
        return workers.Workers(cluster, options, said.append)

    return made


def mine() -> str:
    from rl_workbench.training.rollouts.fingerprint import fingerprint

    return fingerprint()


def one_line(error: pytest.ExceptionInfo[WorkbenchError]) -> str:
    text = str(error.value)
    assert "\n" not in text and "Traceback" not in text
    return text


def test_more_than_the_cluster_has_processors(make) -> None:
    fake = FakeRay([mine()])
    with pytest.raises(WorkbenchError) as raised:
        make(fake, 5, [])
    assert one_line(raised) == (
        "num_envs 5 takes as many processors, and the cluster has 4: --num-envs 4, or more machines"
    )
    assert not fake.made


def test_processors_of_another_kind_are_told_of(make) -> None:
    said: list[str] = []
    make(FakeRay([mine(), "other", mine(), "other"]), 4, said)
    assert len(said) == 1 and said[0].startswith(
        "workers 2, 4 compute to other bits than this machine, by their processors or NumPy: "
    )
    make(FakeRay([mine()]), 4, said)
    assert len(said) == 1, "all of one kind: nothing"


def test_five_losses_at_the_same_part_are_enough(make) -> None:
    from ray.exceptions import ActorDiedError

    said: list[str] = []
    fake = FakeRay([mine(), ActorDiedError()])
    with pytest.raises(WorkbenchError) as raised:
        make(fake, 2, said)
    assert one_line(raised) == (
        "worker 2 of 2 was lost 5 times at the same part: "
        "The actor died unexpectedly before finishing this task"
    )
    line = (
        "worker 2 of 2 is lost (The actor died unexpectedly before finishing this task): another one "
        "plays its part again"
    )
    assert said == [line] * 4
    assert set(fake.killed) == set(fake.made) and len(fake.made) == 6, "none is left"


def test_one_that_is_lost_is_replaced(make) -> None:
    from ray.exceptions import ActorDiedError

    said: list[str] = []
    fake = FakeRay([ActorDiedError(), mine(), mine()])
    workers = make(fake, 2, said)
    assert len(said) == 1 and len(fake.made) == 3
    assert workers.play("policy", [None, None], lambda: False) == [mine()] * 2
    assert workers.play("policy", [None, None], lambda: True) is None, "interrupted"


def test_one_that_does_not_begin_is_replaced(make) -> None:
    said: list[str] = []
    fake = FakeRay([mine(), SILENT, mine()])
    make(fake, 2, said)
    assert said == [
        "for 16 s nothing has come from worker 2 of 2",
        "worker 2 of 2 is lost (it hasn't begun within 180 s): another one plays its part again",
    ]
    assert len(fake.made) == 3 and fake.killed == [fake.made[1]]


def test_one_that_falls_silent_as_it_plays_is_told_of_and_replaced(make) -> None:
    """As one is that was stopped, or whose machine is out of reach with its connection open."""
    said: list[str] = []
    fake = FakeRay([mine()])
    workers = make(fake, 2, said)
    stopped = workers._actors[0] = Actor(SILENT)
    assert workers.play("policy", [None, None], lambda: False) == [mine()] * 2
    assert said == [
        "for 91 s nothing has come from worker 1 of 2",
        "worker 1 of 2 is lost (it hasn't answered within 180 s): another one plays its part again",
    ]
    assert fake.killed == [stopped]


def test_a_part_that_only_takes_long_is_played_to_its_end(make) -> None:
    """Each time it is given twice as long."""
    said: list[str] = []
    fake = FakeRay([mine(), mine(), SILENT])
    workers = make(fake, 2, said)
    workers._actors[0] = Actor(SILENT)
    fake.speaks = fake.now + 180.0 + 360.0 + 700.0
    assert workers.play("policy", [None, None], lambda: False) == [SILENT, mine()]
    assert len(fake.killed) == 2 and "within 360 s" in said[-1]
    fake.speaks = fake.now + 5000.0
    workers.play("policy", [None, None], lambda: False)
    assert len(fake.killed) == 2, "parts took 700 s before"


def test_the_first_part_of_all_may_take_any_time(make) -> None:
    said: list[str] = []
    fake = FakeRay([mine()])
    workers = make(fake, 2, said)
    workers._actors[:] = [Actor(SILENT), Actor(SILENT)]
    fake.speaks = fake.now + 5000.0
    assert workers.play("policy", [None, None], lambda: False) == [SILENT] * 2
    assert said == ["for 91 s nothing has come from worker 1, 2 of 2"]
    assert not fake.killed


@pytest.mark.parametrize("kind", ["ObjectStoreFullError", "OutOfDiskError"])
@pytest.mark.parametrize("where", ["here", "there"])
def test_a_full_object_store(make, kind: str, where: str) -> None:
    from ray import exceptions

    error = getattr(exceptions, kind)("Failed to put object.\nPages.")
    answers = [mine(), mine(), error]
    fake = FakeRay(answers)
    workers = make(fake, 2, [])
    if where == "here":
        fake._full = error
    else:
        workers._actors[1] = Actor(error)
    with pytest.raises(WorkbenchError) as raised:
        workers.play("policy", [None, None], lambda: False)
    text = one_line(raised)
    assert text.startswith("the cluster's object store is full (")
    assert text.endswith("makes a larger one, shorter fragments need less")
    assert "Pages" not in text
