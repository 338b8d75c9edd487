"""The physics engines against each other and against the equations of motion, and how they are loaded."""

import importlib.util
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.comma_locale import NAME, write_comma_locale
from support.python import run_python
from support.refusals import refused
from support.robots import engine_runs as runs
from support.robots.cartpole import CartPole, cartpole_urdf
from support.robots.snippets import joint, link, robot
from support.robots.worlds import assert_near, run

from robot_sim.physics.engines import BULLET, EngineError, make_engine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.world import World


@pytest.mark.parametrize("step", [0.001, 0.0005])
def test_growth_rate_and_period(new_engine, step):
    assert runs.growth_rate(new_engine, step) == pytest.approx(runs.rate(), rel=0.3 * step)
    period = 2.0 * math.pi / runs.rate()
    assert runs.hanging_period(new_engine, step) == pytest.approx(period, rel=1e-5)


@pytest.mark.parametrize(
    ("error", "most"), [(runs.fall_error, 0.02), (runs.push_error, 5e-4), (runs.loop_error, 2e-4)]
)
def test_trajectories_come_nearer_with_the_first_order_of_the_step(new_engine, error, most):
    coarse, fine = error(new_engine, 0.001), error(new_engine, 0.0005)
    assert coarse < most
    assert math.log2(coarse / fine) == pytest.approx(1.0, abs=0.25)


def test_a_wide_swing_loses_energy_with_the_first_order_of_the_step(new_engine):
    """Semi-implicit Euler in joint coordinates is not symplectic: the mass matrix turns with the pole."""
    coarse = runs.energy_error(new_engine, 0.001, 5.0)[0]
    fine = runs.energy_error(new_engine, 0.0005, 5.0)[0]
    assert coarse < 0.1
    assert math.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)


@pytest.fixture
def cartpole(world):
    return world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())


@pytest.mark.parametrize("angle", [-2.5, -0.7, 0.0, 0.3, 1.2, math.pi / 2])
@pytest.mark.parametrize("rate", [-3.0, 0.0, 4.0])
@pytest.mark.parametrize("force", [-5.0, 0.0, 2.0])
def test_one_step_has_the_acceleration_of_the_equations_of_motion(world, cartpole, angle, rate, force):
    cartpole.body.reset_joint(0, 0.0, 0.5)
    cartpole.body.reset_joint(1, angle, rate)
    cartpole.body.apply_efforts((force, 0.0))
    world.step()
    wanted = CartPole().derivative(np.array([0.0, 0.5, angle, rate]), force)
    (_, speed), (_, turn) = cartpole.joint_states()
    got = [(speed - 0.5) / 0.001, (turn - rate) / 0.001]
    assert got == pytest.approx([wanted[1], wanted[3]], rel=1e-6, abs=1e-6)


def test_mirrored_states_move_as_mirror_images(world, cartpole):
    track = []
    for sign in (1.0, -1.0):
        cartpole.set_joint_positions({"cart_pole": sign * 0.1, "stand_cart": sign * 0.05})
        run(world, 300)
        track.append(cartpole.joint_state("stand_cart") + cartpole.joint_state("cart_pole"))
    assert track[0] == tuple(-value for value in track[1])


TURNED = """<robot name="box"><link name="body"><inertial><origin xyz="0.1 0 0.2" rpy="0.3 0 0"/>
<mass value="2"/><inertia ixx="0.1" ixy="0.01" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial>
</link></robot>"""


def test_a_free_body_is_where_it_was_put_and_moves_as_told(make_world):
    world = make_world(gravity=(0.0, 0.0, 0.0))
    start = Pose((1.0, 2.0, 3.0), from_rpy(0.0, 0.0, 0.8))
    model = world.spawn("box", parse_urdf(TURNED), start)
    assert_near(model.state()[0], start)
    model.place(start, ((0.5, 0.0, 0.0), (0.0, 0.0, 1.0)))
    _, (linear, angular) = model.state()
    assert linear == pytest.approx((0.5, 0.0, 0.0), abs=1e-6)
    assert angular == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
    world.reset(joints=False)
    assert model.state()[1] == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.extras("mujoco")
@pytest.mark.parametrize(("state", "force"), [(runs.FALL, 0.0), (runs.SWING, runs.PUSH)])
def test_both_engines_go_the_same_way(state, force):
    begun = (runs.Run(make_engine(name), 0.001, state) for name in ("ode", "mujoco"))
    one, other = (run.track(1.0, force) for run in begun)
    assert np.abs(one - other).max() < 1e-9


@pytest.mark.extras("mujoco")
def test_what_is_left_of_the_error_is_the_step():
    """Integrated by RK4, MuJoCo's model gives what the equations of motion do: the figures are the same."""
    assert runs.fall_error(runs.runge_kutta, 0.001) < 1e-8
    assert runs.push_error(runs.runge_kutta, 0.001) < 1e-9
    assert runs.loop_error(runs.runge_kutta, 0.001) < 1e-8
    assert max(map(abs, runs.energy_error(runs.runge_kutta, 0.001, 5.0))) < 1e-8


def test_an_unknown_engine_is_named():
    with pytest.raises(EngineError, match="'havok' is not known; there are ode, bullet, .* mujoco"):
        make_engine("havok")


@pytest.mark.parametrize("name", BULLET)
def test_names_of_gazebos_engines_mean_pybullet_which_needs_no_mujoco(name):
    code = (
        "import sys; from robot_sim.physics.engines import make_engine;"
        f" print(type(make_engine({name!r})).__name__, 'mujoco' in sys.modules)"
    )
    assert run_python(code).stdout.split() == ["BulletEngine", "False"]


def test_an_engine_that_is_not_installed_is_named_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with refused("'mujoco' is not installed; '", "/ws extras'", error=EngineError):
        make_engine("mujoco")


@pytest.mark.extras("mujoco")
def test_mujoco_stands_in_where_there_is_no_pybullet_and_says_so():
    """As on aarch64, in a process that can't import PyBullet."""
    code = (
        "import sys; sys.modules['pybullet'] = None; import gymnasium, cartpole;"
        "from robot_sim.physics.engines import make_engine; print(type(make_engine()).__name__);"
        "env = gymnasium.make('cartpole/Balance-v0'); env.reset(seed=0); print(len(env.step(0)[0]))"
    )
    answer = run_python(code, check=False)
    assert answer.stdout.split() == ["MujocoEngine", "4"], answer.stderr
    assert "There is no PyBullet for " in answer.stderr


LIMIT = 'lower="-1e6" upper="1e6" effort="0" velocity="0"'
RAIL = joint("rail", "prismatic", "base", "slider", axis="1 0 0", limit=LIMIT)
CHAIN = robot(link("base"), link("slider"), RAIL)


@pytest.mark.parametrize("step", [0.001, 0.01])
def test_a_joint_goes_no_further_than_3_14_in_a_step(make_world, step):
    world = make_world(time_step=0.005, gravity=(0.0, 0.0, 0.0))
    model = world.spawn("chain", parse_urdf(CHAIN), Pose())
    world.set_time_step(step)
    model.body.reset_joint(0, 0.0, 1.9 * math.pi / step)
    world.step()
    assert model.joint_state("rail") == pytest.approx((math.pi, math.pi / step), rel=1e-9)
    model.body.reset_joint(0, 0.0, -0.9 * math.pi / step)
    world.step()
    assert model.joint_state("rail")[0] == pytest.approx(-0.9 * math.pi, rel=1e-6)


def test_a_motor_has_the_force_it_is_given_again_after_the_step_has_changed(make_world):
    world = make_world(time_step=0.001, gravity=(0.0, 0.0, 0.0))
    model = world.spawn("chain", parse_urdf(CHAIN), Pose())
    model.set_motor("rail", 100.0, 2.0)
    world.step()
    world.set_time_step(0.01)
    before = model.joint_state("rail")[1]
    model.set_motor("rail", 100.0, 2.0)
    world.step()
    assert model.joint_state("rail")[1] - before == pytest.approx(10.0 * before, rel=1e-3)


@pytest.mark.extras("mujoco")
def test_in_mujoco_many_fast_joints_that_are_each_slow_enough_go_on():
    world = World(make_engine("mujoco"), gravity=(0.0, 0.0, 0.0))
    chain, places = parse_urdf(CHAIN), (0.0, 3.0, 6.0, 9.0)
    models = [world.spawn(f"chain{y}", chain, Pose((0.0, y, 0.0))) for y in places]
    for model in models:
        model.body.reset_joint(0, 0.0, 3000.0)
    world.step()
    assert [model.joint_state("rail")[1] for model in models] == pytest.approx([3000.0] * 4)
    world.close()


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
@pytest.mark.parametrize("engine", ["ode", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))])
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
