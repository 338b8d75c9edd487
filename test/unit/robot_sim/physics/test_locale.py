"""A process that writes numbers with a comma, as Qt makes it in many countries: robots stay the same."""

import os
import subprocess
import sys

import pytest
from support.comma_locale import NAME, write_comma_locale

PROGRAM = """
import locale, sys
from support.mutations.mesh_files import obj
from support.robots.cartpole import cartpole_urdf
locale.setlocale(locale.LC_NUMERIC, sys.argv[1])
print(locale.localeconv()["decimal_point"], file=sys.stderr)
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane

open("mesh.obj", "wb").write(obj())
mesh = f"<mesh><uri>{sys.argv[3]}/mesh.obj</uri><scale>0.125 0.25 0.5</scale></mesh>"
shell = f'<collision name="c"><geometry>{mesh}</geometry></collision>'
crate = f'<sdf version="1.6"><model name="m"><link name="l">{shell}</link></model></sdf>'
world = World(make_engine(sys.argv[2]))
world.set_gravity((0.0, 0.0, -9.8))
world.spawn("ground_plane", ground_plane(), Pose())
robot = world.spawn("robot", parse_urdf(cartpole_urdf()), Pose((3.5, 0.0, 0.0)))
crate = world.spawn("crate", parse_sdf(crate), Pose((0.0, 0.0, 0.75), (0.0, 0.25, 0.0, 1.0)))
robot.set_joint_positions({"cart_pole": 0.1})
for _ in range(300):
    world.step()
print(robot.joint_states(), crate.link_state("l"))
assert locale.localeconv()["decimal_point"] == ("," if sys.argv[1] == "comma" else ".")
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "engine", ["ode", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))]
)
def test_a_decimal_comma_moves_no_robot_otherwise(tmp_path, engine):
    write_comma_locale(tmp_path)
    texts = {}
    for name, sign in (("C", "."), (NAME, ",")):
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM, name, engine, str(tmp_path)], check=False, text=True,
            env={**os.environ, "LOCPATH": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)},
            cwd=tmp_path, capture_output=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert done.stderr.splitlines()[0] == sign
        texts[name] = done.stdout
    assert texts["C"] == texts[NAME]
