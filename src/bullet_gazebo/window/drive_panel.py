"""The page's tab for driving: keys, a gamepad and buttons command a velocity, or move the tip of an arm."""

import contextlib
import threading
import time
from collections import Counter
from functools import partial

import numpy as np
import rosgraph
import rospy
import viser
from geometry_msgs.msg import Twist, Vector3

from bullet_gazebo.window.model_panel import ModelPanel
from bullet_gazebo.window.panels import MOVE_TIME, SINGLE
from robot_sim.physics.description import Joint
from robot_sim.physics.inverse_kinematics import step_tip
from robot_sim.pictures.visuals import VisibleModel
from ros_calls.service import ServiceFailed

TWIST = Twist._type
NONE = "nothing to drive"
DEAD_MAN = 0.5  # [s of wall time] that a press lasts
PERIOD = 0.05  # [s of wall time] between two messages
# Hotkey, label, and shares of the speed ahead, to the left and up, and of the turning speed.
MOTIONS = (
    ("I", "Ahead", (1.0, 0.0, 0.0, 0.0)), ("M", "Back", (-1.0, 0.0, 0.0, 0.0)),
    ("J", "Turn left", (0.0, 0.0, 0.0, 1.0)), ("L", "Turn right", (0.0, 0.0, 0.0, -1.0)),
    ("U", "Left", (0.0, 1.0, 0.0, 0.0)), ("O", "Right", (0.0, -1.0, 0.0, 0.0)),
    ("Y", "Up", (0.0, 0.0, 1.0, 0.0)), ("H", "Down", (0.0, 0.0, -1.0, 0.0)),
)  # fmt: skip
HELP = (
    "<div style='padding: 0 0.8em'><small>Hold I and M (ahead, back), J and L (turn), U and O (to the"
    " sides), Y and H (up, down), or push a gamepad's sticks, with the mouse on the scene. It stops when all"
    " keys are let go. A button moves the tip of an arm by one step, in the axes of its base.</small></div>"
)
FEWEST = 3  # joints of an arm
RATE = 5.0  # [1/s of wall time] of an arm's steps while a key is held
TURN = 5.0  # [rad/m] of a step
NEAR = 0.1  # [rad, m]: a step begins at set-points, while joints are so near, else where the joints are


class DrivePanel:
    """Publishes velocities while a key is held, from whichever page; then a zero, once. Or moves an arm."""

    def __init__(self, gui: viser.GuiApi, models: ModelPanel) -> None:
        self._models = models
        self._arms: dict[str, tuple[VisibleModel, list[Joint]]] = {}  # joints from the base on
        self._topic = gui.add_dropdown("Topic or arm", [NONE])
        self._speed = gui.add_slider("Speed [m/s]", min=0.05, max=2.0, step=0.05, initial_value=0.3)
        self._turn = gui.add_slider("Turn [rad/s]", min=0.1, max=3.0, step=0.1, initial_value=0.8)
        self._length = gui.add_slider("Step of an arm [mm]", min=1.0, max=20.0, step=1.0, initial_value=10.0)
        buttons = gui.add_button_group("Drive", [label for _, label, _ in MOTIONS])
        gui.add_html(HELP)
        shares = {label: share for _, label, share in MOTIONS}
        buttons.on_click(lambda _: self._click(shares[buttons.value]))
        for key, label, share in MOTIONS:
            command = gui.add_command(f"Drive: {label.lower()}", hotkey=key)  # type: ignore[arg-type]
            command.on_trigger(partial(self._press, share))
        gui.add_command("Drive: stop", hotkey="K").on_trigger(lambda _: self._pressed.clear())
        self._pressed: dict[tuple[float, ...], float] = {}  # until when [s of wall time]
        self._publisher: rospy.Publisher | None = None
        self._is_moving = False
        self._wake = threading.Event()
        threading.Thread(target=self._run, name="driving", daemon=True).start()

    def look(self) -> None:
        """Lists the topics of velocities that have subscribers, and the arms."""
        master = rosgraph.Master(rospy.get_name())
        kinds = dict(master.getTopicTypes())
        _, subscribed, _ = master.getSystemState()
        arms = [(model, arm) for model in self._models.models.values() for arm in self._arms_of(model)]
        self._arms = {f"{arm[-1].child} of {model.name}": (model, arm) for model, arm in arms}
        names = [*sorted(name for name, _ in subscribed if kinds.get(name) == TWIST), *self._arms] or [NONE]
        if names != list(self._topic.options):
            chosen = self._topic.value
            self._topic.options = names
            self._topic.value = chosen if chosen in names else names[0]  # type: ignore[misc]

    def _arms_of(self, model: VisibleModel) -> list[list[Joint]]:
        """Returns chains from the base on, without branches, of one controller or of one for each joint."""
        movers = {each.child: each for each in model.joints}
        branches = Counter(each.parent for each in model.joints)
        owners = {}
        for each in model.joints:
            if not isinstance(holder := self._models.controllers.holder(each.name), str):
                owners[each.child] = SINGLE if holder.kind == SINGLE else holder.topic
        chains = [[movers[child]] for child in owners]
        for chain in chains:
            while branches[up := chain[0].parent] == 1 and owners.get(up) == owners[chain[0].child]:
                chain.insert(0, movers[up])
        inner = {each.name for chain in chains for each in chain[:-1]}
        return [each for each in chains if len(each) >= FEWEST and each[-1].name not in inner]

    def _click(self, share: tuple[float, ...]) -> None:
        if arm := self._arms.get(self._topic.value):
            self._models.attempt(partial(self._step, *arm, np.array(share), MOVE_TIME))
        else:
            self._press(share)

    def _press(self, share: tuple[float, ...], _event: object = None) -> None:
        self._pressed[share] = time.monotonic() + DEAD_MAN
        self._wake.set()

    def _run(self) -> None:
        while not rospy.is_shutdown():
            if not self._is_moving:
                self._wake.wait(1.0)
            self._wake.clear()
            self._send()
            time.sleep(PERIOD)

    def _send(self) -> None:
        """Publishes the velocity of the keys that are held; once none is, a zero. Or moves an arm."""
        now, name = time.monotonic(), self._topic.value
        held = [share for share, until in list(self._pressed.items()) if until > now]
        if name == NONE or not (held or self._is_moving):
            return
        if self._publisher is not None and self._publisher.resolved_name != name:
            self._publisher.publish(Twist())
            self._publisher.unregister()
            self._publisher = None
        self._is_moving, shares = bool(held), np.array([[0.0] * 4, *held]).sum(axis=0)
        if arm := self._arms.get(name):
            with contextlib.suppress(ServiceFailed, rospy.ROSException, OSError):  # a click shows it
                self._step(*arm, shares * RATE * PERIOD, 2.0 * PERIOD)
            return
        self._publisher = self._publisher or rospy.Publisher(name, Twist, queue_size=1)
        linear = Vector3(*(shares[:3] * self._speed.value).tolist())
        self._publisher.publish(Twist(linear, Vector3(0.0, 0.0, float(shares[3] * self._turn.value))))

    def _step(self, model: VisibleModel, arm: list[Joint], shares: np.ndarray, seconds: float) -> None:
        """Moves an arm's tip by shares (4,) of a step: along x, y and z of the model, and about z."""
        positions, sent = self._models.at.get(model.name, {}), self._models.sent
        at = np.array([positions.get(each.name, np.nan) for each in arm])
        if not np.isfinite(at).all():
            raise ServiceFailed(f"{model.name} is gone")
        start = np.array([sent.get(each.name, positions[each.name]) for each in arm])
        step = shares * 1e-3 * self._length.value * (1.0, 1.0, 1.0, TURN)
        near = np.abs(start - at).max() < NEAR
        goals = step_tip(arm, model.tips[arm[-1].name], start if near else at, step)
        if goals is None:
            raise ServiceFailed(f"{model.name}: out of reach, or joints are at their limits")
        named = {each.name: goal for each, goal in zip(arm, goals.tolist(), strict=True)}
        self._models.move(model.name, named, seconds)
