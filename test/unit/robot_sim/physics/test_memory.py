"""Models that come and go leave nothing behind, and what stays in the world doesn't notice."""

import errno
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from support.memory import stays
from support.python import run_python
from support.robots.cartpole import cartpole_urdf
from support.robots.snippets import joint, link, robot

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.engines import bullet_engine as bullet
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.properties import JointProperties, set_joint_properties, set_link_properties
from robot_sim.physics.world import World, ground_plane

pytestmark = pytest.mark.slow

CYCLES, WARM_UP = 40, 30
MOST_GROWTH = 1_000_000  # [bytes] in CYCLES; a cylinder left 34 KB each time
BOX = """<robot name="m"><link name="a"><inertial><origin xyz="0.01 0.02 0.03" rpy="0.1 0.2 0.3"/>
  <mass value="1"/><inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0" iyz="0"/></inertial>
  <collision><geometry>{}</geometry></collision><visual><geometry>{}</geometry></visual></link></robot>"""


@pytest.fixture
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets PyBullet begin anew after little waste, so that few cycles show whether it helps."""
    monkeypatch.setattr(bullet, "MOST_WASTE", 200_000)


def model_of(shape: str, tmp_path: Path, number: int = 0):
    if shape == "links":
        return parse_urdf(chain())
    if shape == "mesh":
        faces = "".join(f"f 1 {i} {i + 1}\n" for i in range(2, 400))
        points = "".join(f"v {i % 7} {i % 11} {i % 13}\n" for i in range(400))
        Path(tmp_path, "mesh.obj").write_text(points + faces)
        text = f'<mesh filename="{tmp_path}/mesh.obj" scale="1 1 {1 + 0.001 * number}"/>'
    else:
        text = f'<cylinder radius="0.5" length="{1.0 + 0.001 * number}"/>'
    return parse_urdf(BOX.format(text, text))


def chain(count: int = 30) -> str:
    """Links of a box and a sphere each, one turning on the other."""
    shape = "<collision><geometry>{}</geometry></collision>".format
    shapes = shape('<box size="0.1 0.1 0.1"/>') + shape('<sphere radius="0.1"/>')
    links = [link(str(number), moment=1.0, more=shapes) for number in range(count)]
    for n in range(count - 1):
        links.append(joint(f"j{n + 1}", "continuous", str(n), str(n + 1), axis="1 0 0"))
    return robot(*links)


@pytest.mark.usefixtures("often")
@pytest.mark.parametrize("shape", ["links", "cylinder", "mesh"])
def test_models_that_come_and_go_leave_no_memory_behind(world, shape, tmp_path):
    def cycle(number: int) -> None:
        world.spawn("m", model_of(shape, tmp_path, number), Pose((0.0, 0.0, 3.0)))
        world.step()
        world.delete("m")

    assert stays(cycle, CYCLES, WARM_UP, MOST_GROWTH)


@pytest.mark.usefixtures("often")
def test_inertias_that_change_leave_no_memory_behind(world):
    """Domain randomisation of lengths: the engine loads the model anew for each."""
    model = world.spawn("m", parse_urdf(chain()), Pose((0.0, 0.0, 3.0)))
    nominal = model.description.links["3"].inertia

    def cycle(number: int) -> None:
        com = nominal.com._replace(position=(0.0, 0.0, 1e-4 * number))
        world.set_inertia(model, "3", replace(nominal, com=com))
        world.step()

    assert stays(cycle, CYCLES, WARM_UP, MOST_GROWTH)


def test_models_that_the_engine_refuses_leave_no_memory_behind(often, sim, monkeypatch, tmp_path):
    """Its shapes are made before the fault is found."""

    def refuse(*args: object) -> None:
        raise DescriptionError("no")

    monkeypatch.setattr("robot_sim.physics.engines.bullet_body.BulletBody._check_meshes", refuse)

    def cycle(number: int) -> None:
        with pytest.raises(DescriptionError):
            sim.world.spawn("m", model_of("cylinder", tmp_path), Pose())

    assert stays(cycle, CYCLES, WARM_UP, MOST_GROWTH)


def stays_among_others(world: World, tmp_path: Path, done: Callable = lambda: None) -> bool:
    """Whether a model was loaded anew while others came and went; it falls all the time."""
    model = world.spawn("stays", model_of("mesh", tmp_path), Pose((0.0, 0.0, 9.0)))
    body = model.body
    Path(tmp_path, "mesh.obj").unlink()
    done()
    for _ in range(CYCLES):
        world.spawn("m", model_of("links", tmp_path), Pose())
        world.delete("m")
    world.step()
    assert model.state()[1][0][2] < 0.0
    return model.body is not body


def test_a_model_whose_file_is_gone_goes_on_in_the_new_world(often, sim, tmp_path):
    assert stays_among_others(sim.world, tmp_path)


def full(*args: object, **kwargs: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_without_room_for_its_files_a_model_keeps_the_old_world(often, sim, monkeypatch, tmp_path):
    writer = "robot_sim.physics.engines.bullet_files.write_mesh"
    assert not stays_among_others(sim.world, tmp_path, lambda: monkeypatch.setattr(writer, full))


@pytest.mark.parametrize("function", ["write_urdf", "_size", "scratch_folder"])
def test_a_full_disk_is_a_reason_and_leaves_the_world_as_it_was(sim, monkeypatch, function):
    world, model = sim.world, parse_urdf(chain(2))
    with monkeypatch.context() as disk:
        disk.setattr(f"robot_sim.physics.engines.bullet_engine.{function}", full)
        with pytest.raises(DescriptionError, match="files can't be written: No space left"):
            world.spawn("chain", model, Pose())
    assert list(world.models) == []
    world.spawn("chain", model, Pose())
    world.step()


def test_in_a_new_world_of_the_engine_contacts_begin_anew_gently(sim):
    """A box on the ground; docs/differences.md has the figure."""
    world, engine = sim.world, sim.world.engine
    client = engine._client
    world.spawn("ground_plane", ground_plane(), Pose())
    shape = '<box size="1 1 1"/>'
    box = world.spawn("box", parse_urdf(BOX.format(shape, shape)), Pose((0.0, 0.0, 0.5)))
    speeds = []
    for step in range(700):
        if step == 500:
            assert speeds[-1] < 1e-3
            engine.waste = 10**9
            world.spawn("other", parse_urdf(chain(2)), Pose((20.0, 0.0, 9.0)))
            assert engine._client is not client
        world.step()
        speeds.append(math.hypot(*box.state()[1][0]))
    assert 1e-3 < max(speeds[500:]) < 0.02
    assert speeds[-1] < 1e-3


def history(monkeypatch: pytest.MonkeyPatch, most_waste: int) -> list:
    """What a cart-pole with changed properties and a tumbling body do while other models come and go."""
    monkeypatch.setattr(bullet, "MOST_WASTE", most_waste)
    engine = bullet.BulletEngine()
    world, clients = World(engine, gravity=(0.1, 0.0, -9.8)), {engine._client}
    world.set_solver(replace(world.solver, iterations=7))
    turned = Pose((0.1, 0.2, 0.3), (0.1, 0.2, 0.3, math.sqrt(0.86)))
    cart = world.spawn("cart", parse_urdf(cartpole_urdf()), turned)
    chained = world.spawn("chain", parse_urdf(chain(4)), Pose((50.0, 0.0, 9.0)))
    text = '<box size="1 1 1"/>'
    free = world.spawn("free", parse_urdf(BOX.format(text, text)), Pose((5.0, 0.0, 9.0)))
    free.place(Pose((5.0, 1.0, 9.0), (0.5, 0.5, 0.5, 0.5)), ((1.0, 2.0, 3.0), (3.0, 2.0, 1.0)))
    cart.set_joint_velocities({"cart_pole": 1.0, "stand_cart": 0.5})
    set_joint_properties(cart, "cart_pole", JointProperties(damping=0.01), world.time_step)
    set_joint_properties(cart, "stand_cart", JointProperties(0.3, -0.1, 0.1, 2.0, 0.7), 0.001)
    set_link_properties(world, chained, "2", chained.description.links["2"].inertia, gravity=False)
    seen: list = []
    for number in range(120):
        if number % 10 == 3:
            world.spawn("other", parse_urdf(chain(3)), Pose((20.0, 0.0, 9.0)))
        if number % 10 == 8:
            world.delete("other")
        if number == 50:
            pole = cart.description.links["pole"].inertia
            world.set_inertia(cart, "pole", replace(pole, mass=0.5))
        cart.body.apply_efforts((0.1, -0.2))
        world.step()
        clients.add(engine._client)
        pose, twist = free.state()
        seen.append([cart.joint_states(), chained.joint_states(), *pose, *twist])
    world.close()
    assert (len(clients) > 1) == (most_waste == 0)
    return seen


def test_a_new_world_of_the_engine_is_not_noticed(monkeypatch):
    """To the bit, but for the orientation of a free body, which PyBullet doesn't tell to the last one."""
    often, never = history(monkeypatch, 0), history(monkeypatch, 10**9)
    for one, other in zip(often, never, strict=True):
        assert one[:2] == other[:2]
        for numbers, expected in zip(one[2:], other[2:], strict=True):
            assert numbers == pytest.approx(expected, abs=1e-12)


COUNT = """
import ctypes, threading
from robot_sim.heap import use_one_arena
{}
libc, done = ctypes.CDLL(None), threading.Barrier(5)

def allocate():
    libc.malloc(100)
    done.wait()

for _ in range(4):
    threading.Thread(target=allocate).start()
done.wait()
libc.fopen.restype = ctypes.c_void_p
file = ctypes.c_void_p(libc.fopen(b"/dev/stdout", b"w"))
libc.malloc_info(0, file)
libc.fclose(file)
"""


@pytest.mark.parametrize(("call", "one"), [("use_one_arena()", True), ("", False)])
def test_threads_share_one_arena_once_it_is_asked_for(call, one):
    assert (run_python(COUNT.format(call)).stdout.count("<heap nr=") == 1) == one
