"""An environment's pictures, its page in the browser, and its render modes."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from robot_envs.backends.backend import RobotBackend
from robot_envs.pictures.placement import Placement, Surroundings
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.task import Task
from robot_envs.world_state import InitialState, WorldState
from robot_sim.physics.pose import Pose, add
from robot_sim.pictures.camera import Camera, CameraLike

if TYPE_CHECKING:
    from viser import ViserServer

    from robot_envs.pictures.page import LivePage, RobotOnPage
    from robot_sim.pictures.renderer import Renderer

__all__ = ["HEIGHT", "WIDTH", "Camera", "CameraLike", "DrawnEnv", "RobotPicture"]

WIDTH, HEIGHT = 640, 320  # [pixels], by default
LARGEST_PICTURE = 4096  # [pixels]
RENDER_MODES = ("human", "rgb_array")


class RobotPicture:
    """Draws a robot and a ground, without a display; loads what it needs with the first picture.

    `base` returns the pose of its root link, which the camera follows; None: where it is spawned. Raises
    ValueError for an impossible size or camera, and later RobotEnvError if the robot's file can't be read.
    """

    def __init__(
        self, robot: Robot, width: int = WIDTH, height: int = HEIGHT, *, camera: CameraLike = None,
        base: Callable[[], Pose] | None = None, beside: Surroundings | None = None,
    ) -> None:  # fmt: skip
        for side in (width, height):
            if not 1 <= side <= LARGEST_PICTURE or side != int(side):
                raise ValueError(f"a picture's width and height lie in [1, {LARGEST_PICTURE}], not {side}")
        self._size = (int(width), int(height))
        if isinstance(camera, Mapping):
            Camera().changed(camera)
        elif not isinstance(camera, Camera | None):
            raise ValueError(f"a camera is a Camera(...), or some of its fields, not {camera!r}")
        self._camera = camera
        self._place = lambda: Placement(robot, base, beside)
        self._loaded: tuple[Placement, Camera, Renderer] | None = None
        self._on_page: list[RobotOnPage] = []

    def __call__(self, positions: Mapping[str, float]) -> np.ndarray:
        """Draws the robot with its joints at positions [rad, m], by name: (height, width, 3) of uint8."""
        placement, camera, renderer = self._loaded = self._loaded or self._load()
        base = placement.base()
        for name, poses in placement.poses(positions, base).items():
            renderer.place(name, poses)
        if camera.follows:
            camera = camera.at(add(camera.target, placement.travelled(positions, base)))
        return renderer.picture(camera, *self._size)

    def _load(self) -> tuple[Placement, Camera, "Renderer"]:
        from robot_sim.pictures.renderer import Renderer  # loads PyBullet

        placement, renderer = self._place(), Renderer()
        for name, shapes in placement.models.items():
            renderer.add(name, shapes)
        return placement, placement.camera(self._camera, self._size[0] / self._size[1]), renderer

    def draw_on(self, server: "ViserServer", positions: Callable[[], Mapping[str, float]]) -> "RobotOnPage":
        """Draws the robot on a viser page, where `positions` puts it; see `RobotEnv.draw_on`."""
        from robot_envs.pictures.page import RobotOnPage

        made = RobotOnPage(server, self._place(), positions, self._camera, self._size)
        self._on_page.append(made)
        return made

    def close(self) -> None:
        """Frees what it has loaded, and takes its switches off pages; may be called twice."""
        while self._on_page:
            self._on_page.pop().close()
        if self._loaded is not None:
            self._loaded[2].close()
            self._loaded = None


class DrawnEnv(gymnasium.Env[Any, Any]):
    """The half of an environment that draws the robot; `RobotEnv` moves it."""

    scene: Scene
    backend: RobotBackend
    task: Task
    _initial: InitialState  # of the episode
    _state: WorldState | None

    def _prepare_drawing(
        self, period: float, camera: CameraLike, size: tuple[int, int], render_mode: str | None
    ) -> None:
        """Checks the options; see `RobotEnv`. The period is that of control [s]."""
        if render_mode not in (None, *RENDER_MODES):
            raise ValueError(f'render_mode is "human" or "rgb_array", not {render_mode!r}')
        self.metadata = {"render_modes": list(RENDER_MODES), "render_fps": max(1, round(1.0 / period))}
        self.render_mode = render_mode
        self._picture = RobotPicture(
            self.scene.robots[0],
            *size,
            camera=camera,
            base=self._base,
            beside=Surroundings(
                self.scene,
                lambda links: self.backend.poses(links),  # noqa: PLW0108 - there is none yet
                self.task.goal_mark,
            ),
        )
        self._shown_for = period  # [s] of wall time, of each state in the render mode "human"
        self._page: LivePage | None = None

    def _show(self) -> None:
        """Shows the state on a page in the render mode "human"."""
        if self.render_mode != "human":
            return
        if self._page is None:
            from robot_envs.pictures.page import LivePage

            self._page = LivePage(self.scene.robots[0].model, self.draw_on, self._shown_for)
        self._page.show()

    def _end_drawing(self) -> None:
        """Frees what draws; may be called twice."""
        if self._page is not None:
            self._page.close()
            self._page = None
        self._picture.close()

    def _positions(self) -> dict[str, float]:
        """Positions of the first robot's joints [rad, m], by plain name."""
        robot, joints = self.scene.robots[0], self._state.joints if self._state else {}
        names = {name: self.scene.joint(robot, name) for name in robot.joints}
        return {plain: joints[name].position for plain, name in names.items() if name in joints}

    def _base(self) -> Pose:
        """Returns the pose of the first robot's root link."""
        robot = self.scene.robots[0]
        if robot.links.fixed_base:
            return self.scene.stand(self._initial, robot).compose(robot.links.root_pose)
        return self.backend.poses([f"{robot.model}::{robot.links.root}"])[0]

    def render(self) -> np.ndarray | None:
        """Returns a picture of the robot, (height, width, 3) of uint8; None in the render mode "human"."""
        return self._picture(self._positions()) if self.render_mode == "rgb_array" else None

    def draw_on(self, server: "ViserServer") -> "RobotOnPage":
        """Draws the robot on a viser page: its visuals, a ground and lights, as in the pictures.

        Needs no render mode, and works with any backend:

            server = viser.ViserServer()
            robot = env.unwrapped.draw_on(server)
            ...  # env.reset(), env.step(action)
            robot()

        Returns a function that moves the robot to where it is now. Its two halves are `look()`, which
        returns where the robot is, and `show()`, which moves it there, then or later. They raise
        SimulatorError if the backend has to be asked where the robot is, and doesn't answer.
        """
        return self._picture.draw_on(server, self._positions)
