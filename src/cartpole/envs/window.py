"""A window that shows the robot: PyBullet's own, at about the pace of real time."""

import tempfile
import time
from pathlib import Path

import pybullet

from cartpole.envs.display import hindrance
from cartpole.envs.robot_files import robot_urdf
from cartpole.envs.robot_names import CART_JOINT, POLE_JOINT
from cartpole.errors import CartpoleError
from cartpole.task import CartPoleState

CAMERA = (1.3, 0.0, -5.0, (0.0, 0.0, 0.2))  # [m], yaw and pitch [degrees], what it looks at [m]
TITLE = "--window_title=cartpole --width=800 --height=500"
NO_WINDOW = (
    'render_mode "human" needs a display to open a window on, and {reason}; '
    'use render_mode "rgb_array" here'
)


class Window:
    """Shows states, each for `period` [s] of wall time.

    Raises:
        CartpoleError: if there is no display, or this process has such a window already.
    """

    def __init__(self, period: float) -> None:
        reason = hindrance()
        if reason:
            raise CartpoleError(NO_WINDOW.format(reason=reason))
        self._period = period
        self._due = time.monotonic()
        try:
            self._client = pybullet.connect(pybullet.GUI, options=TITLE)
        except pybullet.error as error:
            raise CartpoleError(f"a second window can't be opened: {error}") from error
        self._body = self._load()
        self._joints = self._indices()
        pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=self._client)
        pybullet.resetDebugVisualizerCamera(*CAMERA, physicsClientId=self._client)

    def _load(self) -> int:
        with tempfile.TemporaryDirectory(prefix="cartpole_") as folder:
            path = Path(folder, "robot.urdf")
            path.write_text(robot_urdf(), encoding="utf-8")
            return int(pybullet.loadURDF(str(path), physicsClientId=self._client))

    def _indices(self) -> tuple[int, int]:
        names = [
            pybullet.getJointInfo(self._body, index, self._client)[1].decode()
            for index in range(pybullet.getNumJoints(self._body, self._client))
        ]
        return names.index(CART_JOINT), names.index(POLE_JOINT)

    def show(self, state: CartPoleState) -> None:
        """Shows a state, not before the one before it has been seen.

        Raises:
            CartpoleError: if the user has closed the window.
        """
        if not pybullet.isConnected(self._client):
            raise CartpoleError("the window was closed")
        self._due = max(time.monotonic(), self._due + self._period)
        time.sleep(max(0.0, self._due - time.monotonic()))
        for index, position in zip(
            self._joints, (state.cart_position, state.pole_angle), strict=True
        ):
            pybullet.resetJointState(self._body, index, position, 0.0, self._client)

    def close(self) -> None:
        """Closes the window, if it is open."""
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)
