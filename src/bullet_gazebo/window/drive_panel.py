"""The page's tab for driving: keys, a gamepad and buttons command a velocity."""

import threading
import time
from functools import partial

import rosgraph
import rospy
import viser
from geometry_msgs.msg import Twist, Vector3

TWIST = Twist._type
NONE = "no topic of velocities"
DEAD_MAN = 0.5  # [s of wall time] that a press lasts
PERIOD = 0.05  # [s of wall time] between two messages
# Hotkey, label, and shares of the speed ahead and to the left, and of the turning speed.
MOTIONS = (
    ("I", "Ahead", (1.0, 0.0, 0.0)), ("M", "Back", (-1.0, 0.0, 0.0)),
    ("J", "Turn left", (0.0, 0.0, 1.0)), ("L", "Turn right", (0.0, 0.0, -1.0)),
    ("U", "Left", (0.0, 1.0, 0.0)), ("O", "Right", (0.0, -1.0, 0.0)),
)  # fmt: skip
HELP = (
    "<div style='padding: 0 0.8em'><small>Hold I and M (ahead, back), J and L (turn), U and O (to the"
    " sides), or push a gamepad's sticks, with the mouse on the scene. It stops when all"
    " keys are let go.</small></div>"
)


class DrivePanel:
    """Publishes velocities while a key is held, from whichever page; then a zero, once."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._topic = gui.add_dropdown("Topic", [NONE])
        self._speed = gui.add_slider("Speed [m/s]", min=0.05, max=2.0, step=0.05, initial_value=0.3)
        self._turn = gui.add_slider("Turn [rad/s]", min=0.1, max=3.0, step=0.1, initial_value=0.8)
        buttons = gui.add_button_group("Drive", [label for _, label, _ in MOTIONS])
        gui.add_html(HELP)
        shares = {label: share for _, label, share in MOTIONS}
        buttons.on_click(lambda _: self._press(shares[buttons.value]))
        for key, label, share in MOTIONS:
            command = gui.add_command(f"Drive: {label.lower()}", hotkey=key)  # type: ignore[arg-type]
            command.on_trigger(partial(self._press, share))
        gui.add_command("Drive: stop", hotkey="K").on_trigger(lambda _: self._pressed.clear())
        self._pressed: dict[tuple[float, float, float], float] = {}  # until when [s of wall time]
        self._publisher: rospy.Publisher | None = None
        self._is_moving = False
        self._wake = threading.Event()
        threading.Thread(target=self._run, name="driving", daemon=True).start()

    def look(self) -> None:
        """Lists the topics of velocities that have subscribers."""
        master = rosgraph.Master(rospy.get_name())
        kinds = dict(master.getTopicTypes())
        _, subscribed, _ = master.getSystemState()
        names = sorted(name for name, _ in subscribed if kinds.get(name) == TWIST) or [NONE]
        if names != list(self._topic.options):
            chosen = self._topic.value
            self._topic.options = names
            self._topic.value = chosen if chosen in names else names[0]  # type: ignore[misc]

    def _press(self, share: tuple[float, float, float], _event: object = None) -> None:
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
        """Publishes the velocity of the keys that are held; once none is, a zero."""
        now, name = time.monotonic(), self._topic.value
        held = [share for share, until in list(self._pressed.items()) if until > now]
        if name == NONE or not (held or self._is_moving):
            return
        if self._publisher is None or self._publisher.resolved_name != name:
            self._stop()
            self._publisher = rospy.Publisher(name, Twist, queue_size=1)
        self._is_moving = bool(held)
        ahead, left, about = (sum(each) for each in zip(*held, strict=True)) if held else (0, 0, 0)
        speed, turn = self._speed.value, self._turn.value
        linear = Vector3(float(ahead * speed), float(left * speed), 0.0)
        self._publisher.publish(Twist(linear, Vector3(0.0, 0.0, float(about * turn))))

    def _stop(self) -> None:
        if self._publisher is not None:
            self._publisher.publish(Twist())
            self._publisher.unregister()
