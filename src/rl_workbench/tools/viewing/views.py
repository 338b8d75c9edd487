"""How an environment is seen on the page: as itself where it can draw itself there, else in pictures."""

from io import BytesIO
from typing import Any, Protocol

import gymnasium
import numpy as np
import viser
from PIL import Image

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.pictures.filming import packed, take_picture
from rl_workbench.tools.pictures.scenes import DRAW, is_scene

CAMERA, LOOK_AT = (0.0, -1.0, 0.0), (0.0, 0.0, 0.0)  # in front of the pictures
HEIGHT = 1.2  # of a picture, at most
WIDTH = 1.8
FACING = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)  # turns a picture's down to the page's, wxyz
QUALITY = 85  # of JPEG


class View(Protocol):
    """Takes down how an environment looks, and shows it later. Two threads use the two."""

    def take(self) -> Any:
        """How it looks now; small enough to keep thousands."""
        ...

    def show(self, taken: Any) -> None:
        """Shows it on the page."""
        ...


class PictureView:
    """What `render` draws, in the middle of the page.

    Raises:
        WorkbenchError: if the environment draws no pictures.
    """

    def __init__(self, server: viser.ViserServer, env: gymnasium.Env[Any, Any]) -> None:
        if env.render_mode != "rgb_array":
            raise WorkbenchError("the environment draws no pictures")
        self._server, self._env = server, env
        self._shown: viser.ImageHandle | None = None

    def take(self) -> bytes:
        return packed(take_picture(self._env))

    def show(self, taken: bytes) -> None:
        picture = np.asarray(Image.open(BytesIO(taken)))
        if self._shown is not None:
            self._shown.image = picture
            return
        high, wide = picture.shape[:2]
        scale = min(HEIGHT / high, WIDTH / wide)
        self._shown = self._server.scene.add_image(
            "/picture", picture, wide * scale, high * scale, format="jpeg", jpeg_quality=QUALITY,
            wxyz=FACING, cast_shadow=False, receive_shadow=False,
        )  # fmt: skip


class RobotView:
    """An environment that draws itself on pages, as those of `robot_envs` do."""

    def __init__(self, server: viser.ViserServer, env: gymnasium.Env[Any, Any]) -> None:
        self._drawn = getattr(env.unwrapped, DRAW)(server)

    def take(self) -> Any:
        return self._drawn.look()

    def show(self, taken: Any) -> None:
        self._drawn.show(taken)


def make_view(server: viser.ViserServer, env: gymnasium.Env[Any, Any]) -> View:
    """The best that the environment has; those who look at the page already see it from the front.

    Raises:
        WorkbenchError: if it can't be seen.
    """
    if not is_scene(env):
        return PictureView(server, env)
    try:
        view = RobotView(server, env)
    except gymnasium.error.Error as error:  # as where its file can't be read
        raise WorkbenchError(f"the environment can't be drawn: {error}") from error
    front = server.initial_camera
    for client in server.get_clients().values():
        with client.atomic():
            client.camera.position, client.camera.look_at = front.position, front.look_at
            client.camera.fov = front.fov
    return view
