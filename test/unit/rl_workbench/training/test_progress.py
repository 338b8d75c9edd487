"""What the user sees while training: lines in a pipe, a bar on a terminal."""

import io
import time
from types import SimpleNamespace

import pytest

from rl_workbench.training.callbacks import EpisodeResult
from rl_workbench.training.history import History
from rl_workbench.training.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def show_episode(bar: Progress, returns: list[float], length: int, note: str = "") -> None:
    training = SimpleNamespace(history=History(returns=returns))
    episode = EpisodeResult(len(returns), 0, returns[-1], length, None, 99.0, {}, note)
    bar.on_episode(training, episode)


def shown(stream: io.StringIO, episodes: int, total: int, note: str = "") -> str:
    """What a training of so many episodes shows; the i-th has length i and return i / 2."""
    bar = Progress(total, "episode", 0, stream)
    returns: list[float] = []
    for length in range(episodes):
        returns.append(length / 2)
        show_episode(bar, returns, length, note)
    bar.close()
    return stream.getvalue()


def test_without_a_terminal_a_line_every_20_episodes() -> None:
    assert shown(io.StringIO(), 45, 45).splitlines() == [
        "Episode   20 | Reward:  10 | Avg(20):    4.8 | 99 steps/s",
        "Episode   40 | Reward:  20 | Avg(20):   14.8 | 99 steps/s",
    ]


def test_on_a_terminal_a_bar_over_episodes() -> None:
    told = shown(Terminal(), 5, 5, "ε: 0.905")
    assert "5/5" in told and "return 2, length 4, ε 0.905, 99 steps/s" in told


def test_lines_stand_above_the_bar() -> None:
    told = shown(Terminal(), 20, 30)
    assert "Episode   20 | Reward" in told and "20/30" in told


def test_or_over_steps_which_ends_where_the_training_has_ended() -> None:
    stream, deadline = Terminal(), time.monotonic() + 60
    bar = Progress(100, "step", 50, stream)
    assert "50/100" in stream.getvalue(), "one that is gone on with begins where it was"
    while "70/100" not in stream.getvalue():  # it isn't drawn at every step
        bar.on_step(SimpleNamespace(steps=70))
        assert time.monotonic() < deadline
    bar.on_step(SimpleNamespace(steps=100))
    bar.close()
    assert "100/100" in stream.getvalue()


@pytest.mark.parametrize(
    ("unit", "told"), [("step", "step 7 of 900, episode 3"), ("episode", "step 7, episode 3")]
)
def test_a_minute_without_a_line_gets_one(unit: str, told: str) -> None:
    now, stream = [0.0], io.StringIO()
    progress = Progress(900, unit, 0, stream, lambda: now[0])
    training = SimpleNamespace(steps=7, history=History(returns=[1.0, 2.0]))
    for now[0] in (59.0, 60.0, 119.0):
        progress.on_step(training)
    assert stream.getvalue().splitlines() == [told]
