"""A window that shows a robot: PyBullet's own, at about the pace of real time."""

import time
from typing import Generic

from bullet_gazebo.physics.engines.bullet.quiet_import import pybullet
from bullet_gazebo.scratch import scratch_folder
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot, State
from web_page.display import hindrance

Camera = tuple[float, float, float, tuple[float, float, float]]
OPTIONS = "--window_title={title} --width=800 --height=500"
NO_WINDOW = (
    'render_mode "human" needs a display to open a window on, and {reason}; '
    'use render_mode "rgb_array" here'
)


class Window(Generic[State]):
    """Shows states, each for `period` [s] of wall time.

    Args:
        robot: what is shown.
        period: see above.
        camera: distance [m], yaw and pitch [degrees], what it looks at [m].

    Raises:
        RobotEnvError: if there is no display, or this process has such a window already.
    """

    def __init__(self, robot: Robot[State], period: float, camera: Camera) -> None:
        reason = hindrance()
        if reason:
            raise RobotEnvError(NO_WINDOW.format(reason=reason))
        self._period = period
        self._due = time.monotonic()
        options = OPTIONS.format(title=robot.model)
        try:
            self._client = pybullet.connect(pybullet.GUI, options=options)
        except pybullet.error as error:
            raise RobotEnvError(f"a second window can't be opened: {error}") from error
        self._body = self._load(robot.urdf())
        self._joints = self._indices(robot.joints)
        pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=self._client)
        pybullet.resetDebugVisualizerCamera(*camera, physicsClientId=self._client)

    def _load(self, urdf: str) -> int:
        with scratch_folder() as folder:
            path = folder / "robot.urdf"
            path.write_text(urdf, encoding="utf-8")
            return int(pybullet.loadURDF(str(path), physicsClientId=self._client))

    def _indices(self, joints: tuple[str, ...]) -> list[int]:
        names = [
            pybullet.getJointInfo(self._body, index, self._client)[1].decode()
            for index in range(pybullet.getNumJoints(self._body, self._client))
        ]
        return [names.index(joint) for joint in joints]

    def show(self, state: State) -> None:
        """Shows a state, not before the one before it has been seen.

        Raises:
            RobotEnvError: if the user has closed the window.
        """
        if not pybullet.isConnected(self._client):
            raise RobotEnvError("the window was closed")
        self._due = max(time.monotonic(), self._due + self._period)
        time.sleep(max(0.0, self._due - time.monotonic()))
        for index, position in zip(self._joints, state[::2], strict=True):
            pybullet.resetJointState(self._body, index, position, 0.0, self._client)

    def close(self) -> None:
        """Closes the window, if it is open."""
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)
