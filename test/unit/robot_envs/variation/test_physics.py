"""That each option does what its line in docs/sim_to_real.md says: a rig that moves by known laws."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.robots.rig import INERTIA, MASS, PERIOD, RIG, Watch, make_both, make_rig

from robot_envs import RobotEnv, SimulatorError
from robot_envs.variation import LinkScale, Variation

G = 9.8  # [m/s²]
REST = np.zeros(3)
ENGINES = ["bullet", pytest.param("mujoco", marks=pytest.mark.extras("mujoco"))]


def joints_after(env: RobotEnv, action, steps: int = 1) -> dict[str, tuple[float, float]]:
    """Position and velocity of the rig's joints after some steps of one action, by plain name."""
    env.reset(seed=0)
    for _ in range(steps):
        seen, *_ = env.step(np.array(action, float))
    env.close()
    names = [name.removeprefix("rig::") for name in env.scene.joints]
    return dict(zip(names, zip(seen[::2], seen[1::2], strict=False), strict=False))


def vary(backend: str = "bullet", start=None, tick: bool = False, **randomisation):
    """The rig with options that have one value each: low is high; with `tick`, each step is one."""
    fixed = {name: (value, value) if np.isscalar(value) else value for name, value in randomisation.items()}
    period = 0.001 if tick else PERIOD
    return make_rig(backend, start, randomisation=fixed, control_period=period)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("factor", [1.0, 0.5, 0.0])
def test_with_half_the_gravity_it_falls_half_as_fast(engine, factor):
    fallen = joints_after(vary(engine, gravity=factor), REST, 20)["drop"]
    time = 20 * PERIOD
    assert fallen[1] == pytest.approx(-factor * G * time, rel=1e-3)
    assert fallen[0] == pytest.approx(-factor * G * time**2 / 2, rel=0.01)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
def test_a_mass_is_pushed_the_less_the_heavier_it_is(engine, factor):
    pushed = joints_after(vary(engine, mass={"cart": (factor, factor)}), (5.0, 0.0, 0.0), 10)
    assert pushed["rail"][1] == pytest.approx(5.0 / (factor * MASS) * 10 * PERIOD, rel=1e-3)
    assert pushed["drop"][1] == pytest.approx(-G * 10 * PERIOD, rel=1e-3)  # as heavy as before


@pytest.mark.parametrize("engine", ENGINES)
def test_damping_takes_speed_as_its_exponential_says(engine):
    kept = joints_after(vary(engine, {"rail": (0.0, 2.0)}, damping={"rail": (4.0, 4.0)}), REST, 50)
    assert kept["rail"][1] == pytest.approx(2.0 * math.exp(-4.0 / MASS * 50 * PERIOD), rel=0.01)


@pytest.mark.parametrize("engine", ENGINES)
def test_dry_friction_takes_the_same_speed_each_second_and_then_holds(engine):
    options = {"friction": {"rail": (3.0, 3.0)}}
    slowed = joints_after(vary(engine, {"rail": (0.0, 2.0)}, **options), REST, 50)
    assert slowed["rail"][1] == pytest.approx(2.0 - 3.0 / MASS * 50 * PERIOD, rel=0.01)
    held = joints_after(vary(engine, **options), (2.9, 0.0, 0.0), 50)
    assert abs(held["rail"][1]) < 1e-3
    moved = joints_after(vary(engine, **options), (4.0, 0.0, 0.0), 50)
    assert moved["rail"][1] == pytest.approx((4.0 - 3.0) / MASS * 50 * PERIOD, rel=0.01)


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_gains_drive_so_many_times_as_hard(factor):
    """On the first tick towards 0.1 rad p, i and d add up; their clamp stays."""
    env = vary(gains={"servo_position": (factor, factor)}, tick=True)
    env.reset(seed=0)
    env.step(np.array([0.0, 0.0, 0.1]))
    effort = env._state.joints["servo"].effort
    env.close()
    dt, p, i, d = 0.001, 20.1, 0.5, 2.3
    assert effort == pytest.approx(factor * 0.1 * (p + i * dt + d / dt), rel=1e-9)


def test_a_length_moves_the_centre_and_its_moments():
    """The wheel is as heavy as before. Half of each moment about x or y is the integral of z², quadrupled."""
    env = vary(length={"wheel": (2.0, 2.0)}, com={"cart": (0.1, 0.1)})
    env.reset(seed=0)
    robot = next(each for each in env.backend._sim.robots)
    wheel, cart = (robot.model.description.links[name].inertia for name in ("wheel", "cart"))
    env.close()
    assert wheel.com.position == pytest.approx((0.0, 0.0, 0.4))
    assert (wheel.mass, wheel.ixx, wheel.izz) == pytest.approx((1.0, 2.5 * INERTIA, INERTIA))
    assert cart.com.position == pytest.approx((0.1, 0.1, 0.3))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_surfaces_brake_so_many_times_as_much(engine, factor):
    env = make_both(engine, randomisation={"surface_friction": {"sledge::body": (factor, factor)}})
    env.reset(seed=0)
    for _ in range(20):
        seen, *_ = env.step(REST)
    env.close()
    assert 1.0 - seen[-2] == pytest.approx(factor * 0.2 * G * 20 * PERIOD, rel=0.05)


def test_a_task_that_adds_to_set_points_sees_those_that_it_has_sent():
    class Adding(Watch):
        def apply(self, action, state):
            return {"servo_position": state.commands["servo_position"] + 0.1}

    sent = []
    for options in ({}, {"action_delay": 5, "actuator_lag": 0.1, "sensor_delay": 2}):
        env = RobotEnv(RIG, Adding(), **options)
        env.reset(seed=0)
        for _ in range(5):
            env.step(REST)
        sent.append(env._state.commands["servo_position"])
        env.close()
    assert sent == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("engine", ENGINES)
def test_another_environments_robot_is_its_own(engine):
    varied, plain = vary(engine, gravity=0.5, mass={"cart": (2.0, 2.0)}), make_rig(engine)
    rows = []
    for env in (varied, plain, varied, plain):
        env.reset(seed=0)
        rows.append(env.step(np.array([5.0, 0.0, 0.0]))[0])
    varied.close()
    plain.close()
    assert (rows[0] == rows[2]).all()
    assert (rows[1] == rows[3]).all()
    assert rows[0][1] == pytest.approx(rows[1][1] / 2, rel=1e-3)


@pytest.mark.parametrize(
    ("variation", "text"),
    [
        (Variation({"kart": LinkScale(2.0)}), "no link 'kart' to vary; did you mean 'cart'?"),
        (Variation(damping={"rial": 2.0}), "no joint 'rial' to vary; did you mean 'rail'?"),
        (Variation(gains={"motor": 2.0}), "no controller 'motor' to vary; did you mean 'motors'?"),
        (Variation({"cart": LinkScale(-1.0)}), "link cart can't be changed: mass -2.0"),
        (Variation(damping={"rail": -1.0}), "joint rail can't be changed: a damping of -1.0"),
        (Variation(surfaces={"cart": -1.0}), "surfaces of link cart can't be changed"),
    ],
)
def test_a_variation_of_ones_own_that_can_not_be_is_refused(variation, text):
    env = make_rig()
    with pytest.raises(SimulatorError) as refused:
        env.backend.vary(variation)
    env.close()
    assert text in str(refused.value)


def test_dry_friction_does_nothing_to_a_joint_that_is_set_in_position():
    """As docs/sim_to_real.md says: such a joint goes where it is told, as in Gazebo."""
    urdf = RIG.urdf.replace("EffortJointInterface", "PositionJointInterface")
    servo = {"type": "position_controllers/JointPositionController", "joint": "servo"}
    kind = "position_controllers/JointGroupPositionController"
    motors = {"type": kind, "joints": ["rail", "drop"]}
    robot = replace(RIG, urdf=urdf, controllers={"servo_position": servo, "motors": motors})
    rows = []
    for friction in (0.0, 50.0):
        env = RobotEnv(robot, Watch(), randomisation={"friction": (friction, friction)})
        env.reset(seed=0)
        rows.append([env.step(np.array([0.01 * n, 0.0, 0.02 * n]))[0] for n in range(10)])
        env.close()
    assert np.array_equal(*rows)
    assert rows[0][-1][2] > 0.05
