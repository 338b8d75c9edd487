"""Episodes played by hand on a page: held keys, or a gamepad's sticks, choose the actions."""

import argparse
import queue
import time
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from html import escape
from typing import Any

import numpy as np
import viser
from gymnasium import spaces

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools.recording import CAMERA, LOOK_AT, make_view, step_rate
from rl_workbench.training.checked import Env
from rl_workbench.training.demonstrations import Demonstration, Recorder
from rl_workbench.training.progress import tell, warn
from web_viewer.keys import PAIRS
from web_viewer.server import ServedPage

HELD = 0.5  # [s of wall time] that a press lasts
IDLE_PERIOD = 0.05  # [s] between two looks for a press
UNDONE = 1.0  # [s of simulated time] that an undo takes back
KEEP, SUCCESS, FAILURE, UNDO, DISCARD = "Keep", "Success", "Failure", "Undo", "Discard"
VERDICTS = {KEEP: None, SUCCESS: True, FAILURE: False}  # that overrule the environment's own
HINTS = {
    KEEP: "save the episode, with the environment's own verdict",
    SUCCESS: "save the episode as a success",
    FAILURE: "save the episode as a failure",
    UNDO: f"take back {UNDONE:g} s",
    DISCARD: "begin the episode again",
}


class HeldKeys:
    """Actions by a page's keys.

    Each number of a Box has two keys, towards its upper and its lower bound; without a key it is 0, or the
    bound that is nearest to 0. Each choice of a Discrete has one, and the last choice stays.

    Raises:
        WorkbenchError: If the space has more numbers, or choices, than there are keys.
    """

    def __init__(self, gui: viser.GuiApi, env: Env) -> None:
        space = env.action_space
        pairs = [*PAIRS]
        if isinstance(space, spaces.Discrete):
            pairs[:2] = pairs[1::-1]  # of two choices, mostly left and right
            names = [f"choice {int(space.start) + number}" for number in range(int(space.n))]
        elif isinstance(space, spaces.Box):
            size, given = space.low.size, getattr(getattr(env.unwrapped, "task", None), "action_names", ())
            numbers = given if len(given) == size else range(1, size + 1)
            names = [f"{sign}{number}" for number in numbers for sign in "+-"]
        else:
            raise WorkbenchError(f"actions of {space} can't be driven by hand: --policy plays them")
        self._space, self._until = space, dict.fromkeys("".join(pairs), 0.0)
        if len(names) > len(self._until):
            raise WorkbenchError(
                f"{len(self._until)} keys can't drive actions of {space}: --policy plays them"
            )
        self._strength = gui.add_slider("Strength", 0.05, 1.0, 0.05, 1.0)
        self._strength.visible = isinstance(space, spaces.Box)
        self._choice = 0
        for number, (key, name) in enumerate(zip(self._until, names, strict=False)):
            command = gui.add_command(f"Action {name}", hotkey=key.upper())  # type: ignore[arg-type]
            command.on_trigger(partial(self._press, key, number))
        words = [
            f"<b>{key.upper()}</b> {escape(name)}" for key, name in zip(self._until, names, strict=False)
        ]
        gui.add_html(
            "<div style='padding: 0 0.8em'><small>The time runs from the first key on. Hold keys, with the"
            f" mouse on the scene, or push a gamepad's sticks: {', '.join(words)}</small></div>"
        )

    def _press(self, key: str, number: int, _event: object = None) -> None:
        self._until[key], self._choice = time.monotonic() + HELD, number

    @property
    def any(self) -> bool:
        """Whether a key is held."""
        return max(self._until.values()) > time.monotonic()

    def release(self) -> None:
        """Forgets what was pressed so far."""
        self._until = dict.fromkeys(self._until, 0.0)

    def action(self) -> Any:
        """Returns the action of the keys that are held."""
        space, now = self._space, time.monotonic()
        if isinstance(space, spaces.Discrete):
            return int(space.start) + self._choice
        assert isinstance(space, spaces.Box)
        low, high = space.low.ravel(), space.high.ravel()
        rest = np.clip(0.0, low, high)
        up = np.where(np.isfinite(high), high, rest + 1.0) - rest
        down = np.where(np.isfinite(low), low, rest - 1.0) - rest
        held = np.array([until > now for until in self._until.values()])[: 2 * len(rest)]
        way = np.where(held[0::2], up, 0.0) + np.where(held[1::2], down, 0.0)
        return (rest + self._strength.value * way).reshape(space.shape).astype(space.dtype)


class Driver:
    """The page: a picture of the environment, its keys, and buttons that keep, undo or discard an episode."""

    def __init__(self, server: viser.ViserServer, env: Env, recorder: Recorder) -> None:
        self._server, self._recorder = server, recorder
        self._view, self._rate = make_view(server, env), step_rate(env)
        gui = server.gui
        self._keys = HeldKeys(gui, env)
        self._speed = gui.add_slider("Speed", 0.1, 1.0, 0.1, 1.0, hint="of real time")
        self._clicks: queue.SimpleQueue[str] = queue.SimpleQueue()
        for word, hint in HINTS.items():
            button = gui.add_button(word, hint=hint)
            button.on_click(partial(self._click, word))
        self._about = gui.add_html("")
        self._shown: tuple[int, int] | None = None  # seed and step of what the page shows

    def _click(self, word: str, _event: object) -> None:
        self._clicks.put(word)

    def play(self, seed: int, interrupt: Interrupt) -> Demonstration | None:
        """Returns an episode once its driver has kept it; None if Ctrl-C came before."""
        recorder, due = self._recorder, 0.0
        recorder.begin(seed)
        is_running = False  # from the first key on
        while not interrupt.requested():
            clicked = None if self._clicks.empty() else self._clicks.get()
            if clicked in VERDICTS and recorder.length:
                return recorder.episode(VERDICTS[clicked])
            if clicked in (UNDO, DISCARD):
                undone = round(UNDONE * self._rate) if clicked == UNDO else recorder.length
                recorder.undo(max(undone, 1))
                self._keys.release()
                is_running = False
            is_seen = bool(self._server.get_clients())
            is_running = is_seen and not recorder.has_ended and (is_running or self._keys.any)
            self._show(seed)
            if not is_running:
                time.sleep(IDLE_PERIOD)
                continue
            due = max(time.monotonic(), due + 1.0 / (self._rate * self._speed.value))
            time.sleep(due - time.monotonic() if due > time.monotonic() else 0.0)
            recorder.step(self._keys.action())
        return None

    def _show(self, seed: int) -> None:
        recorder = self._recorder
        if self._shown == (seed, recorder.length):
            return
        self._shown = seed, recorder.length
        self._view.show(self._view.look())
        lines = [f"seed {seed}, step {recorder.length}, return {recorder.total_reward:.1f}"]
        if recorder.has_ended:
            verdict = {None: "", True: ": success", False: ": no success"}[recorder.success]
            lines.append(f"the episode has ended{verdict}")
        self._about.content = f'<div style="padding: 0.4em 0.8em">{"<br>".join(lines)}</div>'


def driven(
    recorder: Recorder, env: Env, seeds: range, interrupt: Interrupt, arguments: argparse.Namespace
) -> Iterator[Demonstration]:
    """Serves the page, says where, and yields each episode that its driver keeps, until Ctrl-C."""
    interrupt.defer()
    page = ServedPage(arguments.out.name, CAMERA, LOOK_AT, arguments.host, arguments.port)
    with closing(page):
        driver = Driver(page.server, env, recorder)
        page.announce("the environment", "drives it", tell, warn, not arguments.no_browser)
        for seed in seeds:
            if (episode := driver.play(seed, interrupt)) is None:
                return
            yield episode
