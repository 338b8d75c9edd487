"""Worlds with things that sensors meet."""

import pytest
from support.robots.snippets import sdf, sdf_link

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose

SHAPES = {
    "box": "<box><size>{} {} {}</size></box>",
    "cylinder": "<cylinder><radius>{}</radius><length>{}</length></cylinder>",
    "sphere": "<sphere><radius>{}</radius></sphere>",
}
HERE = Pose()


@pytest.fixture
def put(world):
    """Spawn a model of one shape: `put(name, kind, size, pose, static, tag, retro)`."""

    def spawn(name, kind, size, at=HERE, static=True, tag="collision", retro=0.0):
        shape = SHAPES[kind].format(*size)
        shapes = f'<{tag} name="c"><laser_retro>{retro}</laser_retro><geometry>{shape}</geometry></{tag}>'
        text = sdf(sdf_link("link", more=shapes, moment=1.0), static=static)
        return world.spawn(name, parse_sdf(text), at)

    return spawn
