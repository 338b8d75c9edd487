"""Full disks and low limits of memory and files: one line of error, and later the same result."""

import random
import resource
from collections.abc import Callable
from pathlib import Path

import pytest
from support.stress.disks import can_mount, small_disk
from support.stress.scenario import Scenario
from support.stress.trainings import Forked, forked, new
from support.training.training_runs import assert_no_doubles, assert_same_run, summary

NAMES = ["dqn", "reinforce"]
LARGE = 64 << 20  # [bytes]; more than any of these trainings writes
MEMORY = 200 << 20  # [bytes]; more than any of these trainings needs once all is imported
full = pytest.mark.stress(full=True)


def one_line(training: Forked, *words: str) -> None:
    """It ended well, or with one line that says why."""
    code, told = training.code(), training.output
    assert code in (0, 1, 2), f"exit code {code}:\n{told}"
    assert "Traceback" not in told, told[-4000:]
    if code:
        complaints = [line for line in told.splitlines() if "rl-workbench train:" in line]
        assert len(complaints) == 1, told
        assert any(word in complaints[0] for word in words), complaints[0]


def same_in_the_end(name: str, run: Path, unharmed: Path) -> None:
    """With room for all it comes to the same bits: gone on with, or begun anew where it never began."""
    begun = (run / "config.json").exists()
    arguments = ["--resume", str(run)] if begun else new(name, run)
    with forked(arguments, run.parent / "again") as training:
        training.ended()
    assert summary(run)["complete"]
    assert_no_doubles(run)
    assert_same_run(unharmed, run)


@pytest.mark.stress
def test_full_disks(scenario: Scenario, whole, tmp_path: Path) -> None:
    """Of the run folder: too small from anywhere between its first and its last byte on."""
    if not can_mount(tmp_path / "probe"):
        pytest.skip("only root makes file systems")
    unharmed = {name: whole(name) for name in NAMES[: scenario.share(50)]}
    needed = {name: size_of(run) for name, run in unharmed.items()}

    def case(number: int, dice: random.Random) -> None:
        name = NAMES[number % len(unharmed)]
        room = int(needed[name] * dice.uniform(0.0, 1.1)) // 4096 * 4096
        with small_disk(tmp_path / str(number) / "disk", max(room, 4096)) as disk:
            run = disk.folder / "run"
            with forked(new(name, run), tmp_path / str(number)) as training:
                one_line(training, "No space left on device")
            disk.grow(LARGE)
            same_in_the_end(name, run, unharmed[name])

    scenario.run("full disk of the run folder, resumed", 50, case, lanes=2)


def size_of(run: Path) -> int:
    """What a run folder takes on a disk [bytes]."""
    return sum(path.lstat().st_blocks * 512 for path in run.rglob("*"))


@pytest.mark.parametrize(
    ("what", "limit", "draw"),
    [
        pytest.param("file descriptors", resource.RLIMIT_NOFILE, lambda d: d.randint(4, 24), marks=full),
        pytest.param("memory", resource.RLIMIT_AS, lambda d: d.randrange(MEMORY), marks=full),
    ],
)  # fmt: skip
def test_low_limits(scenario: Scenario, whole, tmp_path: Path, what: str, limit: int, draw: Callable) -> None:
    unharmed = {name: whole(name) for name in NAMES}

    def case(number: int, dice: random.Random) -> None:
        name = NAMES[number % len(NAMES)]
        run = tmp_path / str(number) / "run"
        with forked(new(name, run), run.parent, {limit: draw(dice)}) as training:
            one_line(training, "Too many open files", "memory")
        same_in_the_end(name, run, unharmed[name])

    scenario.run(f"low limit of {what}, resumed", 30, case, lanes=2)
