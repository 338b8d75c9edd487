"""The clockwork: order of a tick, pause, lock-step, resets, and taking turns."""

import threading

import pytest
from support.robots.cartpole import cartpole_urdf

from bullet_gazebo.control.hardware import RobotHardware
from bullet_gazebo.control.manager import STRICT, ControllerManager
from bullet_gazebo.control.transmissions import read_description
from bullet_gazebo.physics.engines.bullet_engine import BulletEngine
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.simulator import NotInLockstep, Simulator

BOUND = 60.0  # [s]
CART = {"type": "effort_controllers/JointPositionController", "joint": "stand_cart",
        "pid": {"p": 100.0, "i": 0.01, "d": 10.0}}  # fmt: skip
STATES = {"type": "joint_state_controller/JointStateController", "publish_rate": 120}


def make_robot(sim):
    model = sim.world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())
    hardware = RobotHardware(read_description(cartpole_urdf()))
    robot = ControlledRobot(model, hardware, ControllerManager(hardware))
    sim.add_robot(robot)
    robot.manager.load("states", STATES)
    robot.manager.load("cart", CART)
    robot.manager.switch(["states", "cart"], [], STRICT)
    return robot


@pytest.fixture
def sim():
    simulator = Simulator(World(BulletEngine()), lockstep=True)
    yield simulator
    simulator.world.close()


def advance(sim, ticks):
    with sim.lock:
        sim.advance(ticks)


def test_listeners_see_the_state_before_the_step_with_the_time_after_it(sim):
    robot = make_robot(sim)
    with sim.lock:
        sim.set_joint_positions(robot.model, {"cart_pole": 0.1})
    seen = []
    sim.listeners.append(lambda now: seen.append((now, robot.model.joint_state("cart_pole")[0])))
    advance(sim, 2)
    assert seen[0] == (1_000_000, 0.1)
    assert seen[1][0] == 2_000_000
    assert seen[1][1] > 0.1
    assert sim.sim_time == pytest.approx(0.002)


def test_an_effort_is_reported_on_the_tick_after_it_acted(sim):
    robot = make_robot(sim)
    samples = []
    robot.manager.get("states").outputs[0].sink = samples.append
    robot.manager.get("cart").command(0.02)
    advance(sim, 20)
    assert samples[0].efforts == (0.0, 0.0)
    assert samples[1].efforts[1] != 0.0
    assert abs(samples[1].efforts[1]) <= 30.0


def test_lock_step_is_bit_for_bit_repeatable_across_resets(sim):
    robot = make_robot(sim)
    runs = []
    for _ in range(3):
        sim.reset_simulation()
        track = []
        for step in range(100):
            robot.manager.get("cart").command(0.02 * (step % 7))
            advance(sim, 8)
            track.append(
                [(j.position, j.velocity, j.effort) for j in robot.hardware.joints.values()]
            )
        runs.append(track)
    assert runs[0] == runs[1] == runs[2]


@pytest.mark.parametrize("ticks", [0, -1])
def test_less_than_one_tick_is_refused(sim, ticks):
    with sim.lock, pytest.raises(ValueError, match="at least 1"):
        sim.advance(ticks)
    assert sim.now == 0


def test_a_world_that_runs_by_itself_cannot_be_stepped():
    sim = Simulator(World(BulletEngine()))
    with sim.lock, pytest.raises(NotInLockstep, match="lockstep:=true"):
        sim.advance(1)
    sim.world.close()


def test_moved_joints_are_reported_at_once_and_set_points_relatched(sim):
    robot = make_robot(sim)
    sim.pause()
    robot.manager.get("cart").command(0.3)
    advance(sim, 100)
    samples = []
    robot.manager.get("states").outputs[0].sink = samples.append
    with sim.lock:
        sim.set_joint_positions(robot.model, {"cart_pole": 0.2, "stand_cart": -0.1})
    assert len(samples) == 1
    assert samples[0].positions == (0.2, -0.1)
    assert samples[0].velocities == samples[0].efforts == (0.0, 0.0)
    assert robot.manager.get("cart").set_point == -0.1
    with sim.lock:
        sim.set_joint_positions(robot.model, {"cart_pole": 0.0, "stand_cart": -0.1})
    advance(sim, 100)  # upright, at its set-point: no kick
    assert robot.model.joint_state("stand_cart")[0] == pytest.approx(-0.1, abs=1e-9)


def test_without_relatch_the_old_set_point_stays_as_in_gazebo():
    sim = Simulator(World(BulletEngine()), lockstep=True, relatch=False)
    robot = make_robot(sim)
    robot.manager.get("cart").command(0.3)
    sim.reset_world()
    assert robot.manager.get("cart").set_point == 0.3
    sim.world.close()


def test_reset_world_keeps_time_and_joints_and_reset_simulation_neither(sim):
    robot = make_robot(sim)
    robot.manager.get("cart").command(0.2)
    advance(sim, 200)
    position, velocity = robot.model.joint_state("stand_cart")
    assert velocity != 0.0
    sim.reset_world()
    assert robot.model.joint_state("stand_cart") == (position, 0.0)
    assert sim.now == 200_000_000
    sim.reset_simulation()
    assert robot.model.joint_state("stand_cart") == (0.0, 0.0)
    assert sim.now == 0


def test_time_runs_by_itself_until_paused():
    sim = Simulator(World(BulletEngine()), max_update_rate=0.0)
    sim.pause()
    reached = threading.Event()
    sim.listeners.append(lambda now: reached.set() if now >= 50_000_000 else None)
    thread = threading.Thread(target=sim.run)
    thread.start()
    try:
        assert sim.now == 0
        sim.unpause()
        assert reached.wait(BOUND)
        sim.pause()
        now = sim.now
        with sim.lock:
            assert sim.now == now
    finally:
        sim.stop()
        thread.join(BOUND)
    assert not thread.is_alive()
    assert sim.now == now
    sim.world.close()


def test_a_slow_rate_can_be_changed_and_stopped_at_once():
    sim = Simulator(World(BulletEngine()), max_update_rate=5e-324)
    thread = threading.Thread(target=sim.run)
    thread.start()
    ticking = threading.Event()
    sim.listeners.append(lambda now: ticking.set() if now > 2_000_000 else None)
    sim.max_update_rate = 1000.0
    assert ticking.wait(BOUND)
    sim.max_update_rate = 1e-12
    sim.stop()
    thread.join(BOUND)
    assert not thread.is_alive()
    sim.world.close()


@pytest.mark.parametrize(
    ("options", "rate", "paused", "outruns"),
    [
        ({"lockstep": True}, 1000.0, False, True),
        ({}, 1000.0, False, False),
        ({}, 500.0, False, False),
        ({}, 2000.0, False, True),
        ({}, 0.0, False, True),
        ({}, 1000.0, True, True),  # only gz world moves it then
    ],
)
def test_it_knows_when_it_is_faster_than_the_clock(options, rate, paused, outruns):
    sim = Simulator(World(BulletEngine()), **options)
    assert sim.outruns_the_clock == sim.lockstep
    sim.max_update_rate = rate
    if paused:
        sim.pause()
    assert sim.outruns_the_clock == outruns
    sim.world.close()


def test_time_that_is_held_stands_still_and_the_world_is_not_paused(sim):
    sim.lockstep = False
    sim.unpause()
    ticked = threading.Event()
    sim.listeners.append(lambda now: ticked.set())
    thread = threading.Thread(target=sim.run)
    thread.start()
    try:
        assert ticked.wait(BOUND)
        with sim.holds.hold(60.0, _never):
            with sim.lock:
                held, paused = sim.now, sim.paused
            sim.pause()
            sim.unpause()  # of a client, who doesn't know that time is held
            ticked.clear()
            assert not ticked.wait(0.1)
            assert (sim.now, paused) == (held, False)
        assert ticked.wait(BOUND)
    finally:
        sim.stop()
        thread.join(BOUND)


def test_steps_wait_for_the_end_of_a_hold_and_services_do_not(sim):
    sim.lockstep = False
    done = threading.Event()
    thread = threading.Thread(target=lambda: (sim.step(3), done.set()))
    with sim.holds.hold(60.0, _never), sim.holds.hold(60.0, _never):
        thread.start()
        for _ in range(100):
            with sim.lock:
                assert sim.now == 0
        assert not done.is_set()
    assert done.wait(BOUND)
    thread.join(BOUND)
    assert sim.now == 3_000_000


def test_time_goes_on_when_a_hold_lasts_too_long(sim):
    told = threading.Event()
    with sim.holds.hold(0.01, told.set):
        assert told.wait(BOUND)
        sim.lockstep = False
        sim.step(1)
        assert sim.now == 1_000_000
    assert not sim.holds


def _never():
    raise AssertionError("too late")
