"""The page of a run: recorded episodes of its policies."""

import select
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing
from html import escape
from pathlib import Path
from typing import Any

import viser

from rl_workbench.env_ids import import_module_of
from rl_workbench.starting import Interrupt
from rl_workbench.tools.recording import (
    CAMERA,
    LOOK_AT,
    EpisodeRecorder,
    RecordedEpisode,
    draw_without_display,
)
from rl_workbench.tools.runs import open_run
from rl_workbench.training.progress import tell, warn
from web_viewer.address import LOOPBACK
from web_viewer.server import ServedPage

PERIOD = 1.0 / 30.0  # [s] between two pictures
IDLE_PERIOD = 0.25  # [s] between two checks for a viewer
SPEEDS = {"0.1 ×": 0.1, "0.25 ×": 0.25, "0.5 ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "5 ×": 5.0}
LINGER = 1.0  # [s] on the last frame of an episode
MAX_SEED = 2**31 - 1


def show_run(
    folder: Path, policies: tuple[str, ...], seed: int, env_options: dict[str, Any], *,
    interrupt: Interrupt, host: str = LOOPBACK, port: int | None = None, browser: bool = True,
    beside_training: bool = False,
) -> None:  # fmt: skip
    """Serves the page until Ctrl-C, or until the training that started it ends.

    It plays the episode of a seed again and again, at first by the first of the policies, with options of the
    environment on top of the training's. `port` is None for the first free one. If it is `beside_training`,
    its standard input closes with that.
    """
    import torch

    if not beside_training:
        import_module_of(open_run(folder).env_id)
    draw_without_display()
    torch.set_num_threads(1)  # networks this small are slower on more
    interrupt.defer()

    def is_over() -> bool:
        # Standard input closes with the training, even if that is killed.
        has_ended = beside_training and bool(select.select([sys.stdin], [], [], 0)[0])
        return has_ended or interrupt.requested()

    page = ServedPage(folder.name, CAMERA, LOOK_AT, host, port)
    server = page.server
    with closing(page), closing(EpisodeRecorder(folder, server, env_options)) as recorder:
        if is_over():  # the training was shorter than this page's start
            return
        page.announce("the run", "plays its episodes", tell, warn, browser)
        while not server.get_clients():  # nothing is played without a viewer
            if is_over():
                return
            time.sleep(IDLE_PERIOD)
        _play(server, Playback(server.gui, recorder, policies, seed), is_over)


def _play(server: viser.ViserServer, playback: "Playback", is_over: Callable[[], bool]) -> None:
    last = time.monotonic()
    while not is_over():
        is_watched = bool(server.get_clients())
        time.sleep(PERIOD if is_watched else IDLE_PERIOD)
        now = time.monotonic()
        if is_watched:
            playback.tick(min(now - last, IDLE_PERIOD))
        last = now


class Playback:
    """The controls of the page: as in `show_run`. One thread calls `tick`; clicks come in viser's threads."""

    def __init__(
        self, gui: viser.GuiApi, recorder: EpisodeRecorder, policies: tuple[str, ...], seed: int
    ) -> None:
        self._recorder = recorder
        self._lock = threading.RLock()
        self._position = 0.0  # [steps] in the episode
        self._waited = 0.0  # [s] on its last frame
        self._is_playing = True
        self._drawn: tuple[RecordedEpisode, int] | None = None
        self._button = gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
        self._slider = gui.add_slider("Step", 0, 1, 1, 0)
        self._speed = gui.add_dropdown("Speed", list(SPEEDS), initial_value="1 ×")
        self._which = gui.add_dropdown("Policy", list(policies), initial_value=policies[0])
        self._seed = gui.add_number("Seed", seed, min=0, max=MAX_SEED, step=1)
        self._follow = gui.add_checkbox("Follow newest", True, hint="play each new checkpoint")
        newest = gui.add_button("Play the newest now", icon=viser.Icon.REFRESH)
        self._about = gui.add_html("")  # below the controls, so that its size doesn't move them
        self._button.on_click(lambda _: self.toggle())
        self._slider.on_update(self._seek)
        for choice in (self._which, self._seed):
            choice.on_update(lambda event: self._start() if event.client else None)
        newest.on_click(lambda _: self._start())
        self._start()

    def _start(self) -> None:
        """Starts an episode of the chosen policy's newest checkpoint."""
        with self._lock:
            self._checkpoint = self._recorder.newest(self._which.value)
            self._episode = self._recorder.play(self._which.value, int(self._seed.value))
            self._position = self._waited = 0.0

    def toggle(self) -> None:
        """Plays or pauses."""
        with self._lock:
            self._is_playing = not self._is_playing
            if self._is_playing and self._is_at_end():
                self._position = 0.0
            self._button.label = "Pause" if self._is_playing else "Play"
            self._button.icon = viser.Icon.PLAYER_PAUSE if self._is_playing else viser.Icon.PLAYER_PLAY

    def _seek(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:  # a user's change, not `_show`'s
            with self._lock:
                self._position = float(self._slider.value)

    def _is_at_end(self) -> bool:
        return self._episode.is_over and self._position >= self._episode.length

    def tick(self, period: float) -> None:
        """Shows the frame that is due `period` [s] after the last tick."""
        with self._lock:
            episode = self._episode
            if self._is_playing or not episode.frames:
                self._advance(period)
            if episode.frames:
                self._show(episode, min(int(self._position), episode.length))
            self._describe(episode)

    def _advance(self, period: float) -> None:
        episode = self._episode
        if not self._is_at_end():
            self._position += period * episode.rate * SPEEDS[self._speed.value]
            self._position = min(self._position, float(episode.length))
            return
        if self._follow.value and self._recorder.newest(self._which.value) != self._checkpoint:
            self._start()
            return
        self._waited += period
        if self._waited >= LINGER and episode.frames:
            self._position = self._waited = 0.0

    def _show(self, episode: RecordedEpisode, index: int) -> None:
        self._slider.max = max(1, episode.length)
        if self._drawn is not None and self._drawn[0] is episode and self._drawn[1] == index:
            return
        self._drawn = (episode, index)
        assert self._recorder.view is not None
        self._recorder.view.show(episode.frames[index].seen)
        self._slider.value = index  # type: ignore[misc]

    def _describe(self, episode: RecordedEpisode) -> None:
        lines = [f"{episode.policy or episode.which}, seed {episode.seed}"]
        if episode.frames:
            index = min(int(self._position), episode.length)
            frame = episode.frames[index]
            total = f"of {episode.length}" if episode.is_over else f"of {episode.length}+"
            end = ", ended" if frame.ended else ""
            lines.append(f"step {index} {total}, return {frame.total_reward:.1f}{end}")
            lines.append(f"action {frame.action or '-'}")
        if episode.note:
            lines.append(episode.note)
        text = "<br>".join(map(escape, lines))
        self._about.content = f'<div style="padding: 0.4em 0.8em">{text}</div>'
