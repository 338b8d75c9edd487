"""The page's list of models; the chosen one is followed, and its joints can be moved."""

import contextlib
import html
import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import viser

from bullet_gazebo.window.panels import MOVE_TIME, Attempt, Controllers
from bullet_gazebo.window.remote_scene import Commands
from robot_sim.physics.description import Joint
from robot_sim.physics.files.elements import shown
from robot_sim.pictures.visuals import VisibleModel
from ros_calls.service import ServiceFailed

NONE = "(none)"
MOST_SHOWN = 50  # models in the list
REACH = {"revolute": math.pi, "continuous": math.pi, "prismatic": 2.0}  # [rad, m] without stops
NO_STOP = 1e15
HANDS_OFF = 2.0  # [s] after someone moved a slider
PARTS = 500  # steps of a slider
UNMOVED = "These sliders work only while time stands still:"


class ModelPanel:
    """Lists models, follows the chosen one, or the only one that moves; has a slider for each of its joints.

    `world` is the scene node above all models. For one thread, which alone makes and removes sliders; clicks
    come in viser's threads.
    """

    def __init__(
        self, server: viser.ViserServer, world: viser.FrameHandle, commands: Commands,
        controllers: Controllers, attempt: Attempt, stands: Callable[[], bool],
    ) -> None:  # fmt: skip
        self._server, self._world = server, world
        self._commands = commands
        self.controllers = controllers
        self.attempt = attempt
        self._stands = stands
        self.models: dict[str, VisibleModel] = {}
        self.at: dict[str, dict[str, float]] = {}  # positions of joints by model [rad, m]
        self.sent: dict[str, float] = {}  # set-points by joint [rad, m]
        self._chosen = NONE  # the model that has sliders; a click may choose another at any time
        self._start: np.ndarray | None = None  # [m] where the followed model was at first
        self._followed = ""
        self._turn = threading.Lock()
        # [rad, m] by model and joint, not yet carried out
        self._wanted: dict[tuple[str, str], float] = {}
        self._touched: dict[str, float] = {}  # [s] when someone moved a joint's slider
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        self._choice = server.gui.add_dropdown("Model", [NONE], initial_value=NONE)
        self._follow = server.gui.add_checkbox("Follow", True)
        self._joints = server.gui.add_folder("Joints", visible=False)
        self._unmoved = server.gui.add_html("", visible=False)  # joints whose sliders move nothing
        self._list = server.gui.add_html("")

    def set_models(self, models: Sequence[VisibleModel]) -> None:
        """Lists these models."""
        self.models = {each.name: each for each in models}
        self.sent.clear()
        names = [NONE, *self.models]
        if list(self._choice.options) != names:
            kept = self._choice.value
            self._choice.options = names
            if kept in self.models:
                self._choice.value = kept  # type: ignore[misc]
        self._choose()

    def _choose(self) -> None:
        """Makes sliders for the chosen model."""
        self._chosen = self._choice.value
        model = self.models.get(self._chosen)
        joints = list(model.joints) if model is not None else []
        self._joints.visible = bool(joints)
        for slider in self._sliders.values():
            slider.remove()
        self._sliders = {}
        with self._joints:
            for joint in joints:
                self._sliders[joint.name] = self._slider(self._chosen, joint)

    def _slider(self, model: str, joint: Joint) -> viser.GuiSliderHandle[float]:
        low, high = _range(joint)
        slider = self._server.gui.add_slider(
            shown(joint.name), low, high, (high - low) / PARTS, min(max(0.0, low), high),
            hint="commands the running controller; while time stands still it places the joint",
        )  # fmt: skip

        def moved(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:  # someone moved it
                self._touched[joint.name] = time.monotonic()
                self._wanted[model, joint.name] = float(slider.value)
                self.attempt(lambda: self._move_newest(model, joint.name))

        slider.on_update(moved)
        return slider

    def _move_newest(self, model: str, joint: str) -> None:
        """Moves a joint to where its slider was left; older positions may wait for the same lock."""
        with self._turn:
            position = self._wanted.pop((model, joint), None)
            if position is not None:
                self.move(model, {joint: position}, MOVE_TIME)

    def move(self, model: str, goals: dict[str, float], seconds: float) -> None:
        """Sends joints to positions [rad, m], trajectories in a time [s]; places them while time stands."""
        self.sent |= goals
        if self._stands():
            self._commands.place_joints(model, goals)
            return
        for holder, joint in {self.controllers.holder(joint): joint for joint in goals}.items():
            if isinstance(holder, str):
                raise ServiceFailed(f"{joint}: {holder}; it can be placed while time stands still")
            if model not in self.at:
                raise ServiceFailed(f"{model} is gone")
            self.controllers.command(holder, joint, self.at[model] | goals, seconds)

    def show(self, links: dict[str, np.ndarray], positions: dict[str, dict[str, float]]) -> None:
        """Shows poses (n, 7) of links and positions [rad, m] of joints, both by model."""
        if self._choice.value != self._chosen:
            self._choose()
        self.at = positions
        self._show_joints(positions.get(self._chosen, {}))
        rows = []
        for name, model in list(self.models.items())[:MOST_SHOWN]:
            if name in links:
                x, y, z = model.pose(links[name]).position
                follows = name == self._followed
                rows.append(
                    f"<tr><td>{html.escape(shown(name))}{' (followed)' if follows else ''}</td>"
                    + "".join(f"<td align='right'>{each:.3f}</td>" for each in (x, y, z))
                    + "</tr>"
                )
        rest = len(self.models) - MOST_SHOWN
        more = f"<tr><td colspan='4'>and {rest} more</td></tr>" if rest > 0 else ""
        head = "<tr><th align='left'>model</th><th>x [m]</th><th>y [m]</th><th>z [m]</th></tr>"
        inner = f"{head}{''.join(rows)}{more}"
        self._list.content = f"<table style='width: 100%; padding: 0 0.8em'>{inner}</table>"

    def _show_joints(self, positions: dict[str, float]) -> None:
        """Moves the sliders with their joints, but for those that someone has just moved."""
        now = time.monotonic()
        self._show_unmoved()
        for name, slider in list(self._sliders.items()):
            position = positions.get(name, math.nan)
            if not math.isfinite(position) or now - self._touched.get(name, -math.inf) < HANDS_OFF:
                continue
            shown_at = min(max(position, slider.min), slider.max)
            if abs(shown_at - slider.value) > slider.step:
                slider.value = shown_at  # type: ignore[misc]

    def _show_unmoved(self) -> None:
        """Disables sliders that would move nothing, and says why."""
        reasons = {}
        for joint in self._sliders if not self._stands() else ():
            holder = self.controllers.holder(joint)
            if isinstance(holder, str):
                reasons[joint] = holder
        for joint, slider in self._sliders.items():
            slider.disabled = joint in reasons
        lines = "".join(
            f"<li>{html.escape(shown(joint))}: {html.escape(reason)}</li>"
            for joint, reason in reasons.items()
        )
        inner = f"{UNMOVED}<ul style='margin: 0; padding-left: 1.2em'>{lines}</ul>"
        self._unmoved.content = f"<div style='padding: 0 0.8em'><small>{inner}</small></div>"
        self._unmoved.visible = bool(lines)

    def follow(self, links: dict[str, np.ndarray]) -> None:
        """Keeps the followed model where it is on the page, and moves the world.

        Moving all cameras instead would fight with browsers that meanwhile report where theirs were.
        """
        moving = [each for each in self.models.values() if not each.static]
        model = self.models.get(self._chosen, moving[0] if len(moving) == 1 else None)
        if not self._follow.value or model is None or model.name not in links:
            self._let_go()
            return
        if self._followed != model.name:
            self._let_go()
        place = np.array(model.pose(links[model.name]).position)
        if self._start is None:
            self._start, self._followed = place, model.name
        if np.isfinite(place).all():
            self._world.position = self._start - place

    def _let_go(self) -> None:
        """Moves the world back, and all cameras with it, so that they see the same, if it is still there."""
        way, is_there = -np.array(self._world.position), self._followed in self.models
        self._start, self._followed = None, ""
        if np.abs(way).max() > 0.0:
            self._world.position = (0.0, 0.0, 0.0)
            for client in self._server.get_clients().values() if is_there else ():
                with contextlib.suppress(ValueError):  # the page's camera looks nowhere
                    # This moves the point that it looks at, too.
                    client.camera.position = client.camera.position + way


def _range(joint: Joint) -> tuple[float, float]:
    """Returns the slider's ends [rad, m]: the joint's limits, or defaults for its kind."""
    reach = REACH.get(joint.kind, 1.0)
    if joint.lower >= joint.upper:
        return -reach, reach
    low = joint.lower if joint.lower > -NO_STOP else -reach
    high = joint.upper if joint.upper < NO_STOP else reach
    return (low, high) if low < high else (-reach, reach)
