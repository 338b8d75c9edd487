"""A robot on a page of viser's: as the simulator's window shows it, without a simulator."""

import logging
from collections import defaultdict
from collections.abc import Callable

import numpy as np
import viser

from bullet_gazebo.physics.description import Shape
from bullet_gazebo.physics.files.world_file import empty_world
from bullet_gazebo.pictures.camera import Camera
from bullet_gazebo.pictures.page.picture import Picture
from bullet_gazebo.pictures.page.seen import SeenLink, SeenModel, seen_model
from robot_envs.placement import Placement
from robot_envs.robot import State

logger = logging.getLogger(__name__)


def draw_robot(
    server: viser.ViserServer,
    placement: Placement[State],
    camera: Camera | None,
    aspect: float,
    state: Callable[[], State],
) -> Callable[[], None]:
    """See `RobotPicture.draw_on`; `aspect` is that of the pictures, width to height."""
    world = empty_world()
    others = [
        seen_model(model, number, name, list(model.links), [], collisions=False)
        for number, (name, model) in enumerate(world.models.items(), 1)
    ]
    robot = _seen(placement)
    picture = Picture(server, logger.warning)
    picture.draw([robot, *others], world.lights.values())
    _place(server.initial_camera, placement.camera(camera, aspect))
    still = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]] * sum(len(model.links) for model in others)

    def move() -> None:
        poses = placement.links(state(), placement.base())
        rows = [[*poses[link.name].position, *poses[link.name].orientation] for link in robot.links]
        picture.move(np.array([*rows, *still]))

    move()
    return move


def _seen(placement: Placement[State]) -> SeenModel:
    shapes: dict[str, list[Shape]] = defaultdict(list)
    for link, shape in placement.shapes:
        shapes[link].append(shape)
    links = [SeenLink(name, shapes[name]) for name in placement.description.links]
    return SeenModel(0, placement.name, links)


def _place(page: viser.InitialCameraConfig, camera: Camera) -> None:
    x, y, z = camera.eye.tolist()
    page.position, page.look_at = (x, y, z), camera.target
    page.fov = np.radians(camera.view)
