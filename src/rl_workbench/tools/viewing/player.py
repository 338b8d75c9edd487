"""The page's player: which policy's episode, play and pause, place and speed."""

import threading
from html import escape
from typing import Any

import viser

from rl_workbench.tools.viewing.recorder import Episode, Frame, Recorder

SPEEDS = {"0.1 ×": 0.1, "0.25 ×": 0.25, "0.5 ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "5 ×": 5.0}
AS_IT_IS = "1 ×"
LINGER = 1.0  # [s] at the end of an episode
LARGEST_SEED = 2**31 - 1


class Player:
    """Plays one episode after the other. `tick` is called by one thread; clicks come in threads of viser's.

    Args:
        gui: of the page.
        recorder: plays them.
        policies: to choose from; the first one is played.
        seed: of the first episode.
        next_seeds: go on with the next seed after each episode, `episodes` of them, and then begin anew.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        recorder: Recorder,
        policies: tuple[str, ...],
        seed: int,
        episodes: int = 1,
    ) -> None:
        self._recorder, self._first, self._episodes = recorder, seed, episodes
        self._lock = threading.RLock()
        self._place = 0.0  # [steps] of the episode
        self._waited = 0.0  # [s] at its end
        self._is_playing = True
        self._drawn: tuple[Episode, int] | None = None
        self._told = ""
        self._button = gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
        self._slider = gui.add_slider("Step", 0, 1, 1, 0)
        self._speed = gui.add_dropdown("Speed", list(SPEEDS), initial_value=AS_IT_IS)
        self._which = gui.add_dropdown("Policy", list(policies), initial_value=policies[0])
        self._seed = gui.add_number("Seed", seed, min=0, max=LARGEST_SEED, step=1)
        self._follow = gui.add_checkbox(
            "Newest by itself", True, hint="plays a checkpoint as soon as it is written"
        )
        newest = gui.add_button("Play the newest now", icon=viser.Icon.REFRESH)
        self._about = gui.add_html("")  # below what is clicked, which stays where it is
        self._button.on_click(lambda _: self.toggle())
        self._slider.on_update(self._go)
        for choice in (self._which, self._seed):
            choice.on_update(self._choose)
        newest.on_click(lambda _: self._begin())
        self._begin()

    @property
    def episode(self) -> Episode:
        """The one that is shown."""
        return self._episode

    def _begin(self) -> None:
        """Plays what is chosen, with the newest checkpoint."""
        with self._lock:
            self._checkpoint = self._recorder.newest(self._which.value)
            self._episode = self._recorder.play(self._which.value, int(self._seed.value))
            self._place = self._waited = 0.0

    def _choose(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:
            self._begin()

    def toggle(self) -> None:
        """Plays, or pauses."""
        with self._lock:
            self._is_playing = not self._is_playing
            if self._is_playing and self._is_at_end():
                self._place = 0.0
            self._button.label = "Pause" if self._is_playing else "Play"
            self._button.icon = (
                viser.Icon.PLAYER_PAUSE if self._is_playing else viser.Icon.PLAYER_PLAY
            )

    def _go(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:
            with self._lock:
                self._place = float(self._slider.value)

    def _is_at_end(self) -> bool:
        return self._episode.is_over and self._place >= self._episode.length

    def tick(self, period: float) -> None:
        """Shows what is due `period` [s] after the last tick."""
        with self._lock:
            episode = self._episode
            if self._is_playing or not episode.frames:
                self._advance(period)
            if episode.frames:
                index = min(int(self._place), episode.length)
                self._show(episode, index, episode.frames[index])
            self._tell(episode)

    def _advance(self, period: float) -> None:
        episode = self._episode
        if not self._is_at_end():
            self._place += period * episode.rate * SPEEDS[self._speed.value]
            self._place = min(self._place, float(episode.length))  # of what was played so far
            return
        if self._follow.value and self._recorder.newest(self._which.value) != self._checkpoint:
            self._begin()
            return
        self._waited += period
        if self._waited >= LINGER and episode.frames:
            self._next()

    def _next(self) -> None:
        self._place = self._waited = 0.0
        if self._episodes > 1:
            after = int(self._seed.value) + 1
            is_last = after >= self._first + self._episodes
            self._seed.value = self._first if is_last else after  # type: ignore[misc]
            self._begin()

    def _show(self, episode: Episode, index: int, frame: Frame) -> None:
        if self._slider.max != max(1, episode.length):
            self._slider.max = max(1, episode.length)
        if self._drawn is not None and self._drawn[0] is episode and self._drawn[1] == index:
            return
        self._drawn = (episode, index)
        assert self._recorder.view is not None
        self._recorder.view.show(frame.seen)
        self._slider.value = index  # type: ignore[misc]

    def _tell(self, episode: Episode) -> None:
        lines = [f"{episode.policy or episode.which}, seed {episode.seed}"]
        if episode.frames:
            index = min(int(self._place), episode.length)
            frame = episode.frames[index]
            total = f"of {episode.length}" if episode.is_over else f"of {episode.length}+"
            lines.append(f"step {index} {total}, return {frame.total_reward:.1f}")
            lines.append(f"action {frame.action or '-'}")
        if episode.note:
            lines.append(episode.note)
        text = "<br>".join(map(escape, lines))
        if text != self._told:
            self._told = text
            self._about.content = f'<div style="padding: 0.4em 0.8em">{text}</div>'
