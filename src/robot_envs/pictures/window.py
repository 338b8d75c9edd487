"""A window that shows a robot: PyBullet's own, at about the pace of real time."""

import time
from collections.abc import Mapping

from bullet_gazebo.physics.engines.quiet_pybullet import pybullet
from bullet_gazebo.scratch import scratch_folder
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from viewer.display import hindrance

Camera = tuple[float, float, float, tuple[float, float, float]]
OPTIONS = "--window_title={title} --width=800 --height=500"
NO_WINDOW = (
    'render_mode "human" needs a display to open a window on, and {reason}; '
    'use render_mode "rgb_array" here'
)


class Window:
    """Shows states, each for `period` [s] of wall time.

    Args:
        robot: what is shown.
        period: see above.
        camera: distance [m], yaw and pitch [degrees], what it looks at [m].

    Raises:
        RobotEnvError: if there is no display, or this process has such a window already.
    """

    def __init__(self, robot: Robot, period: float, camera: Camera) -> None:
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
        self._body = self._load(robot.xml)
        self._joints = self._indices()
        pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=self._client)
        pybullet.resetDebugVisualizerCamera(*camera, physicsClientId=self._client)

    def _load(self, urdf: str) -> int:
        with scratch_folder() as folder:
            path = folder / "robot.urdf"
            path.write_text(urdf, encoding="utf-8")
            return int(pybullet.loadURDF(str(path), physicsClientId=self._client))

    def _indices(self) -> dict[str, int]:
        """Of the body's joints, by name."""
        count = pybullet.getNumJoints(self._body, self._client)
        infos = (pybullet.getJointInfo(self._body, each, self._client) for each in range(count))
        return {info[1].decode(): info[0] for info in infos}

    def show(self, positions: Mapping[str, float]) -> None:
        """Shows joints at their positions [rad, m], not before those before have been seen.

        Raises:
            RobotEnvError: if the user has closed the window.
        """
        if not pybullet.isConnected(self._client):
            raise RobotEnvError("the window was closed")
        self._due = max(time.monotonic(), self._due + self._period)
        time.sleep(max(0.0, self._due - time.monotonic()))
        for name, position in positions.items():
            pybullet.resetJointState(self._body, self._joints[name], position, 0.0, self._client)

    def close(self) -> None:
        """Closes the window, if it is open."""
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)
