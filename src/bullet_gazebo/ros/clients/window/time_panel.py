"""The page's controls of time: pause, steps, resets and speed."""

from collections.abc import Callable
from typing import Any

import viser

from bullet_gazebo.ros.clients.window.commands import Commands

SPEEDS = {
    "0.1 ×": 0.1,
    "0.25 ×": 0.25,
    "0.5 ×": 0.5,
    "1 ×": 1.0,
    "2 ×": 2.0,
    "5 ×": 5.0,
    "unlimited": 0.0,
}
OTHER = "other"
MOST_STEPS = 100_000
STILL = 0.005  # of real time; less is no pace that anybody sees
ONLY_STEPS = "a world in lock-step moves by steps only: those that a client asks for, or these here"

Attempt = Callable[[Callable[[], None]], None]
"""Does what a click asks for, and shows whoever clicked what went wrong."""


class TimePanel:
    """Shows and moves time."""

    def __init__(self, gui: viser.GuiApi, commands: Commands, attempt: Attempt) -> None:
        self._commands = commands
        self._attempt = attempt
        self.stands = False  # until somebody lets time go on, or asks for steps
        self._paused = False
        self._lockstep = False
        self._shown = ""
        self._status = gui.add_html("")
        self._pause = gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
        self._pause.on_click(lambda _: attempt(lambda: commands.set_paused(not self._paused)))
        one = gui.add_button("One step", icon=viser.Icon.PLAYER_SKIP_FORWARD)
        one.on_click(lambda _: attempt(lambda: commands.step(1)))
        steps = gui.add_number("Steps", 100, min=1, max=MOST_STEPS, step=1)
        many = gui.add_button("Do these steps", icon=viser.Icon.PLAYER_TRACK_NEXT)
        many.on_click(lambda _: attempt(lambda: commands.step(int(steps.value))))
        world = gui.add_button("Reset world", hint="models where they were spawned; time goes on")
        world.on_click(lambda _: attempt(lambda: commands.reset(everything=False)))
        simulation = gui.add_button("Reset simulation", hint="joints and time to zero as well")
        simulation.on_click(lambda _: attempt(lambda: commands.reset(everything=True)))
        self._speed = gui.add_dropdown("Speed", [*SPEEDS, OTHER], initial_value="1 ×")
        self._speed.on_update(self._choose_speed)

    def _choose_speed(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is not None and self._speed.value != OTHER:  # somebody chose it
            self._attempt(lambda: self._commands.set_speed(SPEEDS[self._speed.value]))

    def show(self, now: float, factor: float, paused: bool, lockstep: bool) -> None:
        """Shows the time [s], the real-time factor, and what moves time."""
        self.stands = paused or (lockstep and factor < STILL)
        if (paused, lockstep) != (self._paused, self._lockstep):
            self._paused, self._lockstep = paused, lockstep
            goes_on = paused and not lockstep
            self._pause.label = "Go on" if goes_on else "Pause"
            self._pause.icon = viser.Icon.PLAYER_PLAY if goes_on else viser.Icon.PLAYER_PAUSE
            for each in (self._pause, self._speed):  # neither does anything in lock-step
                each.disabled = lockstep
                each.hint = ONLY_STEPS if lockstep else None
        if lockstep:
            state = f"lock-step, {_pace(factor)}"
        else:
            state = "paused" if paused else f"real-time factor {factor:.2f}"
        self._write(f"<b>{now:.3f} s</b> &nbsp; {state}")

    def show_missing(self, node: str) -> None:
        """Says that there is no simulator."""
        self._write(f"no simulator {node} (yet)")

    def show_speed(self) -> None:
        """Shows the speed that is set, whoever set it."""
        found = self._commands.physics()
        factor = found.max_update_rate * found.time_step
        names = [name for name, each in SPEEDS.items() if abs(each - factor) < 1e-6]
        name = names[0] if names else OTHER
        if self._speed.value != name:
            self._speed.value = name  # type: ignore[misc]

    def _write(self, text: str) -> None:
        if text != self._shown:
            self._shown = text
            self._status.content = f'<div style="padding: 0.4em 0.8em">{text}</div>'


def _pace(factor: float) -> str:
    """How fast a client's steps come."""
    if factor < STILL:
        return "waits for a client's steps"
    return f"{factor:.{2 if factor < 10 else 0}f} × real time"
