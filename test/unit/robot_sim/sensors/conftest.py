"""Worlds with things that sensors meet."""

import pytest

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose

SHAPES = {
    "box": "<box><size>{} {} {}</size></box>",
    "cylinder": "<cylinder><radius>{}</radius><length>{}</length></cylinder>",
    "sphere": "<sphere><radius>{}</radius></sphere>",
}
HERE = Pose()
MODEL = """<sdf version="1.6"><model name="m"><static>{static}</static><link name="link">
<inertial><mass>1</mass></inertial>{shapes}{more}</link></model></sdf>"""


@pytest.fixture
def put(world):
    """Spawn a model of one shape: `put(name, kind, size, pose, static, tag, more)`."""

    def spawn(name, kind, size, at=HERE, static=True, tag="collision", more="", retro=0.0):
        shape = SHAPES[kind].format(*size)
        shapes = f'<{tag} name="c"><laser_retro>{retro}</laser_retro><geometry>{shape}</geometry></{tag}>'
        text = MODEL.format(static=int(static), shapes=shapes, more=more)
        return world.spawn(name, parse_sdf(text), at)

    return spawn
