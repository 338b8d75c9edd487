"""What is seen of an environment: its pictures, its page, its window."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import gymnasium
import numpy as np

from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.pictures.camera import Camera
from robot_envs.backends.backend import RobotBackend
from robot_envs.pictures.picture import RobotPicture
from robot_envs.pictures.surroundings import Surroundings
from robot_envs.scene import Scene
from robot_envs.world_state import InitialState, WorldState
from viewer.display import hindrance

if TYPE_CHECKING:
    from viser import ViserServer

    from robot_envs.pictures.page import RobotOnPage


class Viewer(Protocol):
    """A window that shows the robot."""

    def show(self, positions: Mapping[str, float]) -> None:
        """Shows joints at their positions [rad, m], by name."""
        ...

    def close(self) -> None:
        """Closes the window; may be called twice."""
        ...


class DrawnEnv(gymnasium.Env[Any, Any]):
    """The half of an environment that draws it; the other half moves it, and says where it is."""

    scene: Scene
    backend: RobotBackend
    _initial: InitialState  # of the episode
    _state: WorldState | None

    def _draw(
        self,
        period: float,
        camera: Camera | None,
        size: tuple[int, int],
        window: Callable[[float], Viewer] | None,
        render_mode: str | None,
    ) -> None:
        """Makes ready what draws; see `RobotEnv`. The period is that of control [s]."""
        self.metadata = {
            "render_modes": ["human", "rgb_array"] if window and not hindrance() else ["rgb_array"],
            "render_fps": max(1, round(1.0 / period)),
        }
        self.render_mode = _known_mode(render_mode, window is not None)
        self._picture = RobotPicture(
            self.scene.robots[0],
            *size,
            camera=camera,
            base=self._base,
            beside=Surroundings(self.scene, self._poses),
        )
        self._window = window(period) if window and render_mode == "human" else None

    def _show(self) -> None:
        """In the window, if there is one."""
        if self._window is not None:
            self._window.show(self._positions())

    def _end_drawing(self) -> None:
        """Frees what draws; may be called twice."""
        if self._window is not None:
            self._window.close()
        self._picture.close()

    def _positions(self) -> dict[str, float]:
        """Of the joints [rad, m], of the first robot, by plain name."""
        robot, joints = self.scene.robots[0], self._state.joints if self._state else {}
        names = {name: self.scene.joint(robot, name) for name in robot.joints}
        return {plain: joints[name].position for plain, name in names.items() if name in joints}

    def _base(self) -> Pose:
        """Where the first robot's root link is."""
        robot = self.scene.robots[0]
        if robot.links.fixed_base:
            return self.scene.stand(self._initial, robot).compose(robot.links.root_pose)
        return self.backend.poses([f"{robot.model}::{robot.links.root}"])[0]

    def _poses(self, links: Sequence[str]) -> Sequence[Pose]:
        """Where links are, each named model::link."""
        return self.backend.poses(links)

    def render(self) -> np.ndarray | None:
        """A picture of the robot as it is, (height, width, 3). A window shows it by itself.

        Raises:
            SimulatorError: if the backend has to be asked where the robot is, and doesn't answer.
        """
        return self._picture(self._positions()) if self.render_mode == "rgb_array" else None

    def draw_on(self, server: "ViserServer", beside: int = 0) -> "RobotOnPage":
        """Draws the robot on a page of viser's: its visuals, a ground and lights, seen as in the pictures.

        Needs no render mode, with any backend:

            server = viser.ViserServer()
            robot = env.unwrapped.draw_on(server)
            ...  # env.reset(), env.step(action)
            robot()

        Args:
            server: the page's.
            beside: so many robots of this kind are on the page already; it is drawn beside them.

        Returns:
            What moves the robot on the page to where it is in that moment: a function, which takes a
            caption to show below the robot, or nothing, and may raise `SimulatorError`. Its two halves
            are `look()`, which tells where the robot is, and `show()`, which moves it there, then or later.

        Raises:
            SimulatorError: if the backend has to be asked where the robot is, and doesn't answer.
        """
        return self._picture.draw_on(server, self._positions, beside)


def _known_mode(mode: str | None, has_window: bool) -> str | None:
    known = ("human", "rgb_array") if has_window else ("rgb_array",)
    if mode is not None and mode not in known:
        names = " or ".join(f'"{name}"' for name in known)
        raise ValueError(f"render_mode is {names}, not {mode!r}")
    return mode
