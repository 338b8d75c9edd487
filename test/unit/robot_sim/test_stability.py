"""Gains that are too high for the step: how high that is, who is told, and what becomes of the robot."""

import logging
import math
import re

import pytest
from support.robots.cartpole import cartpole_urdf
from support.robots.grippers import transmission
from support.robots.robots_in_trouble import Rig, beyond_stops, urdf_of
from support.robots.snippets import WORLD, link, robot
from support.robots.trajectory_rig import Listener

from robot_sim.control.errors import ControlError
from robot_sim.control.manager import STRICT
from robot_sim.control.pid import Gains
from robot_sim.control.trajectory_goals import GoalRequest, Trajectory, TrajectoryPoint

INERTIA = 0.1  # [kg m²] of the wheel
PLUGIN = '<gazebo><plugin filename="libgazebo_ros_control.so" name="c">{}</plugin></gazebo>'
HAND = {"p": 1.0, "d": 0.01}  # d dt / I is about 50 at 1 ms
ARM = {  # p and d as arms' packages ship them for effort controllers
    "pan": (4000.0, 500.0), "lift": (4000.0, 500.0), "elbow": (4000.0, 500.0),
    "wrist_1": (1000.0, 50.0), "wrist_2": (1000.0, 50.0), "wrist_3": (1000.0, 20.0),
}  # fmt: skip
P_ONLY = dict(zip(ARM, (2000.0, 2000.0, 2000.0, 200.0, 100.0, 10.0), strict=True))
TRAJECTORIES = {
    "type": "effort_controllers/JointTrajectoryController", "joints": list(P_ONLY),
    "gains": {joint: {"p": p} for joint, p in P_ONLY.items()}, "constraints": {"goal_time": 0.5},
}  # fmt: skip


def wheel(more="", plugin=""):
    axle = f"""<joint name="axle" type="continuous"><parent link="world"/><child link="disc"/>
      <axis xyz="0 0 1"/>{more}</joint>"""
    drive = transmission("axle", "Effort") + PLUGIN.format(plugin)
    return robot(WORLD, link("disc", moment=INERTIA), axle, drive, name="wheel")


EXACT = wheel(plugin="<pOnlyDamping>0</pOnlyDamping>")


@pytest.fixture
def rig(make_world):
    """Makes robots in a lock-step world, each with a log of what it told."""
    return lambda text, step=0.001: Rig(make_world(ground=True, time_step=step), text)


def swing(rig, gains, step, text, kind):
    """How far off its set-point the wheel is at once, at most, and after 400 steps, and what was told."""
    robot = rig(text, step)
    robot.load(kind, "axle", gains)
    column = 1 if kind == VELOCITY else 0
    robot.model.body.reset_joint(0, 1e-3, 1e-3 / step if column else 0.0)
    robot.controller("axle").command(0.0)
    track = [abs(state[0][column]) for state in robot.run(400 * step)]
    return 1.0 if column else 1e-3, max(track), max(track[-20:]), robot.warnings()


POSITION = "effort_controllers/JointPositionController"
VELOCITY = "effort_controllers/JointVelocityController"


def bound(kind, share_of_d, step, damping=0.0, implicit=False):
    """p and d at the edge of stability; `share_of_d` of the stiffness is d's."""
    own = 2.0 * damping * step
    most = 4.0 * INERTIA + (own if implicit else -own)
    if kind == VELOCITY:
        return most * (1.0 - share_of_d) / (2.0 * step), most * share_of_d / 4.0
    return most * (1.0 - share_of_d) / step**2, most * share_of_d / (2.0 * step)


@pytest.mark.parametrize("step", [0.001, 0.005])
@pytest.mark.parametrize(
    ("kind", "share_of_d"), [(POSITION, 0.0), (POSITION, 0.5), (POSITION, 0.99), (VELOCITY, 0.0),
                             (VELOCITY, 0.3)]
)  # fmt: skip
def test_a_loop_beyond_the_bound_is_softened_and_told_and_one_below_is_neither(rig, kind, share_of_d, step):
    p, d = bound(kind, share_of_d, step)
    first, most, last, told = swing(rig, {"p": 0.97 * p, "d": 0.97 * d}, step, EXACT, kind)
    assert last <= most < 10.0 * first
    assert told == []
    for beyond in (1.03, 100.0):
        gains = {"p": beyond * p, "d": beyond * d}
        first, most, last, told = swing(rig, gains, step, EXACT, kind)
        assert last <= most < 2.0 * first
        assert share_of_d == 0.0 or last < 1e-3 * first
    assert [text for text in told if "would shake" in text and "'axle'" in text]


@pytest.mark.parametrize("stiffness", [2e4, 1e12])
def test_the_joints_own_spring_counts(rig, stiffness):
    spring = f"<springStiffness>{stiffness}</springStiffness>"
    block = f'<gazebo reference="axle">{spring}</gazebo></robot>'
    text = EXACT.replace("</robot>", block)
    p, _ = bound(POSITION, 0.0, 0.001)
    own = stiffness if stiffness < 1e5 else 0.75 * INERTIA / 0.001**2
    first, most, _, told = swing(rig, {"p": 0.97 * (p - own)}, 0.001, text, POSITION)
    assert most < 10.0 * first
    assert told == []
    first, most, _, told = swing(rig, {"p": 0.98 * p}, 0.001, text, POSITION)
    assert most < 10.0 * first
    assert told


@pytest.mark.parametrize("step", [0.001, 0.005])
def test_the_joints_own_damping_counts_as_the_engine_takes_it(rig, step):
    text = wheel('<dynamics damping="20"/>')
    implicit = rig(text, step).model.body.implicit_damping
    p, d = bound(POSITION, 0.9, step, damping=20.0 if step < 0.002 else 10.0, implicit=implicit)
    first, most, _, told = swing(rig, {"p": 0.97 * p, "d": 0.97 * d}, step, text, POSITION)
    assert most < 10.0 * first
    assert told == []
    *_, told = swing(rig, {"p": 1.05 * p, "d": 1.05 * d}, step, text, POSITION)
    assert told


def test_the_warning_names_all_once_and_again_for_other_gains_or_another_step(rig):
    robot = rig(EXACT)
    controller = robot.load(POSITION, "axle", {"p": 10.0, "d": 600.0})
    for _ in range(3):
        robot.manager.loops_changed()
    [told] = robot.warnings()
    assert "controller 'axle_controller' drives joint 'axle' of model 'wheel' with d = 600" in told
    assert "3 times what a step of 0.001 s can follow (about 200)" in told
    controller.pids["pid"].gains = Gains(10.0, d=150.0)
    robot.manager.loops_changed()
    assert len(robot.warnings()) == 1
    robot.sim.set_time_step(0.002)
    assert "step of 0.002 s" in robot.warnings()[1]
    controller.pids["pid"].gains = Gains(10.0, d=700.0)
    robot.manager.loops_changed()
    assert "d = 700" in robot.warnings()[2]


def test_joints_that_are_too_stiff_only_together_are_told(rig):
    """Alone each wrist of the arm could follow its gain; what turns one shakes the other."""
    robot = rig(urdf_of("arm"))
    alone = {}
    for name in ("wrist_1", "wrist_3"):
        robot.load(POSITION, name, {"p": 1.0, "d": 1000.0})
        alone[name] = float(robot.warnings()[-1].rpartition("(about ")[2].partition(")")[0])
    pair = rig(urdf_of("arm"))
    for name, most in alone.items():
        pair.load(POSITION, name, {"p": 1.0, "d": 0.9 * most})
    assert len(pair.warnings()) == 1


@pytest.mark.parametrize("name", ["pendulum", "slides", "cartpole"])
def test_sane_robots_are_told_nothing_of(rig, name):
    robot = rig(cartpole_urdf() if name == "cartpole" else urdf_of(name))
    gains = {"p": 100.0, "d": 10.0} if name == "cartpole" else {"p": 5.0, "d": 0.1}
    for joint in robot.hardware.effort_joints:
        robot.load(POSITION, joint.name, gains)
    robot.run(0.5)
    assert robot.told == []
    assert robot.model.damping_added == {}


@pytest.mark.parametrize("step", [0.001, 0.002, 0.005, 0.01])
def test_a_light_hand_that_fell_before_its_controllers_came_goes_where_they_say(rig, step):
    robot = rig(urdf_of("light_hand"), step)
    names = robot.model.joint_names
    assert beyond_stops(robot.model, robot.run(1.0)) < 2.0
    for name in names:
        robot.load(POSITION, name, HAND)
        robot.controller(name).command(0.0 if "spread" in name else 0.8)
    states = robot.run(2.0)
    assert beyond_stops(robot.model, states) < 2.0 * math.pi
    assert max(abs(speed) for state in states for _, speed in state) <= math.pi / step
    if step == 0.001:
        goals = [0.0 if "spread" in name else 0.8 for name in names]
        assert [position for position, _ in states[-1]] == pytest.approx(goals, abs=0.02)
        assert max(abs(speed) for _, speed in states[-1]) < 1e-6
    for name in names:  # once the cause is gone, it comes back
        robot.controller(name).pids["pid"].gains = Gains(0.002, d=1e-6)
    robot.manager.loops_changed()
    states = robot.run(2.0)
    assert beyond_stops(robot.model, states[-10:]) < 0.05
    assert max(abs(speed) for _, speed in states[-1]) < 20.0


@pytest.mark.parametrize("step", [0.001, 0.002, 0.005, 0.01])
def test_an_arm_with_shipped_gains_does_not_shake(rig, step):
    robot = rig(urdf_of("arm"), step)
    goal = dict(zip(ARM, (0.3, 0.5, 0.9, 0.3, 0.3, 0.3), strict=True))
    for name, (p, d) in ARM.items():
        robot.load(POSITION, name, {"p": p, "d": d})
        robot.controller(name).command(goal[name])
    states = robot.run(3.0)  # it shook by 200 rad/s
    for (position, speed), wanted in zip(states[-1], goal.values(), strict=True):
        assert abs(speed) < 0.01
        assert abs(position - wanted) < 30.0 * step
    assert any("'wrist_3'" in text and "d = 20" in text for text in robot.warnings())


def test_a_light_wheel_with_a_high_gain_keeps_its_speed(rig):
    """A racecar's, p = 1 on 2.6e-4 kg m²: its speed alternated from step to step, and grew."""
    robot = rig(EXACT.replace(str(INERTIA), "0.00026"))
    robot.load(VELOCITY, "axle", {"p": 1.0, "i": 0.01})
    robot.controller("axle").command(20.0)
    speeds = [state[0][1] for state in robot.run(1.0)[-100:]]
    assert speeds == pytest.approx([20.0] * 100, abs=0.1)


def test_a_blow_up_names_the_joint_and_who_drives_it_once(rig):
    robot = rig(urdf_of("arm"))
    robot.load(POSITION, "wrist_3", {"p": 1000.0, "d": 20.0})
    for _ in range(2):
        robot.model.body.reset_joint(5, 0.0, 1e5)
        robot.run(0.1)
    told = [text for text in robot.warnings() if "blew up" in text]
    [wrist] = [text for text in told if "joint 'wrist_3'" in text]
    assert "The controller 'wrist_3_controller' drives it with p = 1000, i = 0, d = 20" in wrist
    alone = rig(urdf_of("arm"))
    alone.model.body.reset_joint(5, 0.0, 1e5)
    alone.run(0.01)
    [told] = alone.warnings()
    assert "joint 'wrist_3' of model 'arm' blew up" in told
    assert "No controller with gains drives it" in told
    assert beyond_stops(alone.model, alone.run(0.1)) < 0.1


@pytest.mark.parametrize("step", [0.001, 0.01])
def test_a_chain_without_stops_that_became_fast_comes_back(rig, step):
    robot = rig(urdf_of("arm").replace('type="revolute"', 'type="continuous"'), step)
    for index, turns in enumerate((0.5, -0.9, 0.8, -0.7, 0.9, -0.6)):
        robot.model.body.reset_joint(index, 0.0, turns * math.pi / step)
    fastest = [max(abs(speed) for _, speed in state) for state in robot.run(4.0)]
    assert min(fastest) * step < 0.3
    assert robot.warnings()


def test_in_a_process_it_is_told_by_pythons_logging(rig, caplog):
    robot = rig(EXACT)
    robot.use_default_log()
    with caplog.at_level(logging.WARNING):
        robot.load(POSITION, "axle", {"p": 10.0, "d": 600.0})
    assert "would shake" in caplog.text


def amplitudes(rig, text, gains=None):
    """The wheel's amplitude [rad] in the first and the last of ten periods, let go at 0.1 rad."""
    robot = rig(text)
    robot.load(POSITION, "axle", gains or {"p": 250.0})  # 50 rad/s
    robot.model.body.reset_joint(0, 0.1)
    robot.controller("axle").command(0.0)
    period = 2.0 * math.pi / 50.0
    track = [abs(state[0][0]) for state in robot.run(10.0 * period)]
    ticks = len(track) // 10
    return max(track[:ticks]), max(track[-ticks:]), robot


def test_a_joint_with_a_p_gain_alone_comes_to_rest_as_if_a_twentieth_of_critically_damped(rig):
    first, last, robot = amplitudes(rig, wheel())
    # A maximum lies somewhere in each period; between two of the same phase it is 9 periods.
    assert math.log(first / last) == pytest.approx(0.05 * 2.0 * math.pi * 9.0, rel=0.1)
    [(level, told)] = robot.told
    assert level == logging.INFO
    assert "'axle'" in told
    assert "<pOnlyDamping>" in told


def test_a_model_that_asks_for_exactness_rings_for_ever(rig):
    first, last, robot = amplitudes(rig, EXACT)
    assert last == pytest.approx(first, rel=1e-3)
    assert robot.told == []


def outcome_of_a_trajectory(robot):
    """What a cubic of 1.5 s ends with, half a second after the arm was let sag into its P gains."""
    robot.manager.load("arm", TRAJECTORIES)
    robot.manager.switch(["arm"], [], STRICT)
    robot.run(0.5)
    told = Listener()
    points = [TrajectoryPoint(1_500_000_000, (0.8, 0.5, 0.9, 0.5, -0.5, 0.8), (0.0,) * 6)]
    with robot.sim.lock:
        request = GoalRequest(Trajectory(tuple(P_ONLY), points))
        robot.manager.get("arm").pursue("goal", request, told)
    robot.run(2.5)
    [outcome] = told.outcomes
    return outcome.kind, outcome.text


def test_an_arm_with_p_gains_alone_reaches_its_goals_but_rings_without_that_damping(rig):
    assert outcome_of_a_trajectory(rig(urdf_of("arm"))) == ("succeeded", "")
    exact = re.sub("<plugin.*?/>", "", urdf_of("arm"))
    exact = exact.replace("</robot>", PLUGIN.format("<pOnlyDamping>0</pOnlyDamping>") + "</robot>")
    kind, text = outcome_of_a_trajectory(rig(exact))
    assert kind == "aborted"
    assert "velocity" in text


@pytest.mark.parametrize(
    ("joint", "gains"),
    [('<dynamics damping="1e-9"/>', {"p": 250.0}), ('<dynamics friction="1e-9"/>', {"p": 250.0}),
     ("", {"p": 250.0, "d": 1e-9})],
)  # fmt: skip
def test_what_has_damping_friction_or_a_d_gain_is_left_as_it_is(rig, joint, gains):
    first, last, _ = amplitudes(rig, wheel(joint), gains)
    assert last == pytest.approx(first, rel=1e-3)


def test_the_damping_goes_with_the_controller_and_with_a_d_gain(rig):
    _, _, robot = amplitudes(rig, wheel())
    assert robot.model.damping_added["axle"] == pytest.approx(0.1 * math.sqrt(250.0 * INERTIA))
    robot.controller("axle").pids["pid"].gains = Gains(250.0, d=0.1)
    robot.manager.loops_changed()
    assert robot.model.damping_added == {}
    robot.controller("axle").pids["pid"].gains = Gains(250.0)
    robot.manager.loops_changed()
    assert robot.model.damping_added
    robot.manager.switch([], ["axle_controller"])
    assert robot.model.damping_added == {}
    robot.hardware.joints["axle"].command = 0.0
    robot.model.body.reset_joint(0, 0.0, 3.0)
    assert robot.run(0.1)[-1][0][1] == pytest.approx(3.0, rel=1e-9)


@pytest.mark.parametrize("text", ["much", "-0.1", "1.1", "nan", ""])
def test_a_damping_that_is_none_refuses_the_control(rig, text):
    with pytest.raises(ControlError, match="pOnlyDamping"):
        rig(wheel(plugin=f"<pOnlyDamping>{text}</pOnlyDamping>"))
