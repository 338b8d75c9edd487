"""A whole training on a fake plant: what lies in the folder, and what happens when it fails."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from unit.learning_fakes import FakePlant

from cartpole.errors import CartpoleError
from cartpole.training import pg_run
from cartpole.training.interrupt import Interrupt
from cartpole.training.pg_run import Training
from cartpole.training.pg_settings import Settings

TAGS = {
    "Reward",
    "Value Loss",
    "Policy Loss",
    "charts/episodic_return",
    "charts/episodic_length",
    "charts/SPS",
}
ALWAYS = {"policy_network.pth", "value_network.pth", "learning_curve.png", "summary.json"}


class InterruptAfter(Interrupt):
    """Ctrl-C, pressed when the training asks for the n-th time."""

    def __init__(self, asked: int) -> None:
        super().__init__()
        self._left = asked

    def requested(self) -> bool:
        self._left -= 1
        if self._left <= 0:
            self.signal = 2
        return super().requested()


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if not path.name.startswith("events.out")}


def summary(folder: Path) -> dict:
    return json.loads((folder / "summary.json").read_text())


def trained(folder: Path, **choices) -> dict:
    Training(Settings(**choices), folder, FakePlant(), Interrupt()).run()
    return summary(folder)


def test_a_training_leaves_networks_curve_summary_and_logs(tmp_path: Path, capsys) -> None:
    result = trained(tmp_path, episodes=6, save_every=5, seed=1)
    saved = {f"{kind}_network_episode_{n}.pth" for kind in ("policy", "value") for n in (0, 5)}
    assert files(tmp_path) == ALWAYS | saved
    assert result["episodes"] == len(result["lengths"]) == 6
    assert result["steps"] == sum(result["lengths"])
    assert result["failure"] is None and not result["interrupted"]
    assert len(result["evaluation"]["lengths"]) == 20
    assert len(set(result["evaluation"]["lengths"])) > 1, "every episode starts somewhere else"
    told = capsys.readouterr().out
    assert "trained 6 episodes" in told and "greedy over 20" in told
    assert str(tmp_path) in told


def test_tensorboard_has_the_documents_tags_and_the_fields(tmp_path: Path) -> None:
    result = trained(tmp_path, episodes=4)
    log = EventAccumulator(str(tmp_path))
    log.Reload()
    assert set(log.Tags()["scalars"]) == TAGS
    assert [point.step for point in log.Scalars("Reward")] == [0, 1, 2, 3]
    lengths = [point.value for point in log.Scalars("charts/episodic_length")]
    assert lengths == result["lengths"]


def test_same_seed_same_files(tmp_path: Path) -> None:
    results = []
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        trained(tmp_path / name, episodes=5, seed=4)
        results.append(torch.load(tmp_path / name / "policy_network.pth", weights_only=True))
        results.append(summary(tmp_path / name)["evaluation"])
    assert torch.equal(results[0]["fc.weight"], results[2]["fc.weight"])
    assert results[1] == results[3]


def test_start_noise_is_seeded(tmp_path: Path) -> None:
    lengths = []
    for name, noise in (("first", 0.05), ("again", 0.05), ("none", 0.0)):
        (tmp_path / name).mkdir()
        lengths.append(trained(tmp_path / name, episodes=5, seed=4, start_noise=noise)["lengths"])
    assert lengths[0] == lengths[1] != lengths[2]


def test_a_simulator_that_dies_costs_only_its_episode(tmp_path: Path) -> None:
    plant = FakePlant(fail_after=300)
    with pytest.raises(CartpoleError, match=r"has ended; stopped after \d+ of") as raised:
        Training(Settings(episodes=1000, save_every=0), tmp_path, plant, Interrupt()).run()
    assert str(tmp_path) in str(raised.value)
    assert files(tmp_path) == ALWAYS
    result = summary(tmp_path)
    assert result["failure"] and 0 < result["episodes"] < 300


def test_a_simulator_that_dies_in_the_first_episode(tmp_path: Path) -> None:
    with pytest.raises(CartpoleError, match="stopped after 0"):
        Training(Settings(), tmp_path, FakePlant(fail_after=2), Interrupt()).run()
    assert files(tmp_path) == ALWAYS - {"learning_curve.png"}


def test_ctrl_c_saves_and_skips_the_evaluation(tmp_path: Path) -> None:
    interrupt = InterruptAfter(300)
    Training(Settings(episodes=1000, save_every=0), tmp_path, FakePlant(), interrupt).run()
    assert files(tmp_path) == ALWAYS
    result = summary(tmp_path)
    assert result["interrupted"] and result["evaluation"] is None
    assert 0 < result["episodes"] < 300
    assert interrupt.exit_code == 130


def test_a_simulator_that_dies_of_the_same_ctrl_c_is_no_failure(tmp_path: Path) -> None:
    class Dying(FakePlant):
        def act(self, set_point: float):
            if self.actions == 50:
                interrupt.signal = 2
                raise CartpoleError("the simulator has ended")
            return super().act(set_point)

    interrupt = Interrupt()
    Training(Settings(), tmp_path, Dying(), interrupt).run()
    assert summary(tmp_path)["interrupted"]


def test_a_full_disk_is_one_line(tmp_path: Path, monkeypatch) -> None:
    def full(path: Path, write: Callable) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("cartpole.training.checkpoints.write_atomically", full)
    with pytest.raises(CartpoleError, match="No space left on device"):
        Training(Settings(episodes=2, save_every=0), tmp_path, FakePlant(), Interrupt()).run()


def test_the_mean_of_the_last_episodes(tmp_path: Path) -> None:
    result = trained(tmp_path, episodes=70, save_every=0)
    assert result[f"mean_length_last_{pg_run.LAST}"] == pytest.approx(
        sum(result["lengths"][-60:]) / 60
    )
