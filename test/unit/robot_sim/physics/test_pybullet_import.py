"""PyBullet comes without a word and hides none of others; a decimal comma changes no robot."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.comma_locale import NAME, write_comma_locale
from support.python import run_python

SRC = Path(__file__).resolve().parents[4] / "src"
LIBRARY = SRC / "robot_sim/physics/engines/quiet_pybullet.py"
BESIDE = """
import os, sys, threading
sys.setswitchinterval(1e-6)
done = threading.Event()
count = 0
def write():
    global count
    while not done.is_set():
        os.write(2, b"%d\\n" % count)
        count += 1
thread = threading.Thread(target=write, daemon=True)
thread.start()
from robot_sim.physics.engines import make_engine
make_engine()
done.set()
thread.join()
print(count)
"""


def outcome(code: str, *python: str) -> subprocess.CompletedProcess[str]:
    command = [*python, sys.executable, "-c", f"import sys; sys.path = {sys.path}; {code}"]
    return subprocess.run(command, capture_output=True, text=True, check=True)


@pytest.mark.parametrize(
    "code",
    [
        "from robot_sim.physics.engines import make_engine; make_engine()",
        "import gymnasium, cartpole; gymnasium.make('cartpole/Balance-v0').reset(seed=0)",
        "import robot_envs.pictures.drawn",
    ],
)
def test_an_engine_comes_without_a_word(code: str) -> None:
    done = outcome(code)
    assert (done.stdout, done.stderr) == ("", "")


def test_what_another_thread_writes_meanwhile_comes_whole() -> None:
    done = outcome(f"exec({BESIDE!r})")
    lines = done.stderr.splitlines()
    assert sorted(map(int, lines)) == list(range(int(done.stdout)))


def test_what_c_writes_meanwhile_comes_afterwards(tmp_path: Path) -> None:
    (tmp_path / "pybullet.py").write_text("import ctypes; ctypes.CDLL(None).perror(b'of C')")
    code = f"sys.path.insert(0, {str(tmp_path)!r}); import robot_sim.physics.engines.quiet_pybullet"
    assert outcome(code).stderr.startswith("of C: ")


def test_a_library_that_cannot_be_loaded_says_why(tmp_path: Path) -> None:
    text = "import sys; print('a reason', file=sys.stderr); raise ImportError('broken')"
    (tmp_path / "pybullet.py").write_text(text)
    code = f"sys.path.insert(0, {str(tmp_path)!r}); import robot_sim.physics.engines.bullet_engine"
    with pytest.raises(subprocess.CalledProcessError) as caught:
        outcome(code)
    assert "a reason" in caught.value.stderr
    assert "ImportError: broken" in caught.value.stderr


def test_without_a_standard_error() -> None:
    code = "from robot_sim.physics.engines import make_engine; make_engine(); print('made')"
    assert outcome(code, "sh", "-c", 'exec "$@" 2>&-', "sh").stdout == "made\n"


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
    env = {**os.environ, "LOCPATH": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    texts = {}
    for name, sign in (("C", "."), (NAME, ",")):
        done = run_python(PROGRAM, name, engine, str(tmp_path), check=False, env=env, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert done.stderr.splitlines()[0] == sign
        texts[name] = done.stdout
    assert texts["C"] == texts[NAME]
