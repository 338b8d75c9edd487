"""Checkpoint files: whole or absent, told from damaged and foreign ones, and which of them counts."""

import os
import random
import resource
from pathlib import Path
from typing import Any

import pytest
import torch

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import check_optimizer
from rl_workbench.storage import save_tensors, write_atomically
from rl_workbench.training import checkpoints
from rl_workbench.training.checkpoints import Checkpoints, candidates, read


def test_what_was_saved_is_read(tmp_path: Path) -> None:
    Checkpoints(tmp_path, 3).save(5, {"a": torch.ones(2), "b": [1, "two", None]})
    for name in ("last.pt", "checkpoints/step_000000005.pt"):
        content = read(tmp_path / name)
        assert content.pop("format") == checkpoints.FORMAT
        assert content.pop("a").tolist() == [1, 1] and content == {"b": [1, "two", None]}
    assert not (tmp_path / "best.pt").exists()


def test_the_best_one_keeps_its_name_and_the_newest_stay(tmp_path: Path) -> None:
    writer = Checkpoints(tmp_path, 2)
    for step in range(5):
        writer.save(step, {"steps": step}, best=step == 1)
    assert read(tmp_path / "best.pt")["steps"] == 1
    assert read(tmp_path / "last.pt")["steps"] == 4
    left = sorted(path.name for path in (tmp_path / "checkpoints").iterdir())
    assert left == ["step_000000003.pt", "step_000000004.pt"]


def test_where_the_disk_knows_no_second_names_it_is_copied(tmp_path: Path, monkeypatch) -> None:
    def refused(*names: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr("os.link", refused)
    Checkpoints(tmp_path, 3).save(5, {"steps": 5}, best=True)
    assert read(tmp_path / "best.pt") == read(tmp_path / "last.pt")
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 half a zip", b"\x80\x04 a pickle", b"text"])
def test_foreign_files_are_told_from_checkpoints(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "last.pt"
    path.write_bytes(content)
    with pytest.raises(WorkbenchError, match=r"last.pt is damaged, or no checkpoint"):
        read(path)


@pytest.mark.parametrize("content", [{"q_net": {}}, {"format": "rl_workbench 1"}, [1, 2]])
def test_somebody_elses_torch_file_is_told_from_a_checkpoint(tmp_path, content: object) -> None:
    torch.save(content, tmp_path / "last.pt")
    with pytest.raises(WorkbenchError, match="is not a checkpoint of a training"):
        read(tmp_path / "last.pt")


def test_a_file_that_would_run_code_is_refused(tmp_path: Path) -> None:
    class Evil:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "ran",))

    torch.save({"format": checkpoints.FORMAT, "x": Evil()}, tmp_path / "last.pt")
    with pytest.raises(WorkbenchError, match="damaged, or no checkpoint"):
        read(tmp_path / "last.pt")
    assert not (tmp_path / "ran").exists()


def test_one_damaged_anywhere_is_told(tmp_path: Path) -> None:
    path, draw = tmp_path / "last.pt", random.Random(0)
    save_tensors(path, {"format": checkpoints.FORMAT, "tensor": torch.zeros(50)})
    good, damaged = path.read_bytes(), 0
    for _ in range(300):
        content = bytearray(good)
        for _ in range(draw.choice([1, 20])):
            content[draw.randrange(len(content))] = draw.randrange(256)
        path.write_bytes(content[: draw.choice([len(content), draw.randrange(len(content))])])
        try:
            assert read(path)["tensor"].eq(0).all()
        except WorkbenchError:
            damaged += 1
    assert damaged > 200


def test_a_disk_that_is_full_in_the_midst_of_a_checkpoint(tmp_path: Path) -> None:
    """The real writer on a real limit: torch hides the system's error behind one of its own."""
    path = tmp_path / "last.pt"
    save_tensors(path, {"old": 1})
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, before[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            save_tensors(path, {"new": torch.zeros(5000)})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [each.name for each in tmp_path.iterdir()] == ["last.pt"]
    assert torch.load(path, weights_only=True) == {"old": 1}


def test_a_written_file_follows_the_umask(tmp_path: Path) -> None:
    old = os.umask(0o027)
    try:
        write_atomically(tmp_path / "file", lambda stream: stream.write(b""))
    finally:
        os.umask(old)
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o640


def test_which_checkpoint_a_folder_stands_for(tmp_path: Path) -> None:
    (tmp_path / "checkpoints").mkdir()
    names = ["last.pt", "best.pt", *(f"checkpoints/step_{step:09d}.pt" for step in (5, 999_999_999,
                                                                                10**9))]  # fmt: skip
    for name in names:
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "last.pt").unlink()
    (tmp_path / "last.pt").hardlink_to(tmp_path / "checkpoints/step_1000000000.pt")
    found = [str(path.relative_to(tmp_path)) for path in candidates(tmp_path)]
    assert found == ["last.pt", names[3], names[2], "best.pt"]
    assert candidates(tmp_path, best_first=True)[0].name == "best.pt"


@pytest.mark.parametrize("optimizer", [torch.optim.Adam, torch.optim.RMSprop, torch.optim.SGD])
def test_an_optimizers_moments_of_another_size_are_refused(optimizer: Any) -> None:
    """torch would write beyond them, and the process might crash."""

    def made(size: int) -> Any:
        weights = torch.nn.Parameter(torch.ones(size))
        result = optimizer([weights], lr=0.1)
        weights.grad = torch.ones(size)
        result.step()
        return result

    new = optimizer([torch.nn.Parameter(torch.ones(4))], lr=0.3)
    check_optimizer(new, new.state_dict())
    check_optimizer(new, made(4).state_dict())
    if optimizer is not torch.optim.SGD:  # which has no moments
        with pytest.raises(ValueError, match=r"of shape \(4,\), not \(3,\)"):
            check_optimizer(new, made(3).state_dict())
