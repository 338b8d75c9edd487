"""What grippers have besides controllers: PIDs of followers, suction, a hold on what is gripped."""

import math

import pytest
from support.robots.grippers import cube, gripper, plugin
from support.robots.worlds import run
from support.ros.silent_topics import silence

from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from robot_envs.backends.in_process import InProcessWorld
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.world_state import InitialState
from robot_sim.control.pid import Gains, Pid
from robot_sim.grippers import GraspHold, GripRule, PidFollower, Suction
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.simulator import Simulator

PID = plugin(
    "libgazebo_mimic_joint_plugin.so",
    joint="left", mimicJoint="right", hasPID="", maxEffort=0.5, sensitiveness=0.001,
)  # fmt: skip
HAND = gripper(mimic="", more=PID)
GAINS = {"p": 100.0, "d": 2.0}


def test_a_pid_moves_a_follower_with_no_more_than_its_effort(world):
    sim = Simulator(world, lockstep=True)
    model = world.spawn("gripper", parse_urdf(HAND), Pose())
    follower = PidFollower(model, "right", Pid(Gains(**GAINS)))
    sim.listeners.append(follower.update)
    model.set_motor("left", 0.0, 1e6)
    for effort, holds in ((0.4, True), (0.6, False)):
        model.body.reset_joint(model.joint_index("left"), 0.02)
        model.put_followers()
        for _ in range(1000):
            model.body.add_effort(model.joint_index("right"), effort)
            sim.advance(1)
        # With 0.4 N it gives way by p; with 0.6 N up to the stop.
        assert (model.joint_state("right")[0] < 0.03) == holds


@pytest.mark.parametrize(("gains", "lags"), [({"right": GAINS}, True), ({}, False)])
def test_an_environment_gives_followers_their_gains(gains, lags):
    """Without gains it is a gear, which doesn't lag."""
    parameters = {
        "gazebo_ros_control": {"pid_gains": gains},
        "grip": {"type": "effort_controllers/JointEffortController", "joint": "left"},
    }
    robot = Robot(HAND, parameters, run=("grip",), world=None)
    world = InProcessWorld(Scene([robot]), 0.01)
    world.reset(InitialState())
    for _ in range(15):
        world.act({"grip": 0.5})
    states = world._sim.world.models["gripper"].joint_states()
    states = dict(zip(robot.links.joints, states, strict=True))
    off = states["left"][0] - states["right"][0]
    assert states["left"][0] > 0.005
    assert (abs(off) > 1e-4) == lags
    world.close()


def suck(world, suction, ticks):
    for tick in range(ticks):
        suction.update(tick)
        world.step()


def test_suction_pulls_what_is_near_holds_it_and_lets_go(world):
    lift = world.spawn("gripper", parse_urdf(HAND), Pose((0.0, 0.0, 0.3)))
    lift.set_motor("lift", 0.0, 1e4)
    near = world.spawn("cube", parse_urdf(cube()), Pose((0.0, 0.0, 0.557)))
    far = world.spawn("far", parse_urdf(cube()), Pose((0.0, 0.5, 0.1)))
    suction = Suction(world, lift, "lift_link")
    suction.update(0)
    assert not suction.holds()
    near.place(Pose((0.0, 0.0, 0.592)))
    suction.on = True
    suck(world, suction, 300)
    assert suction.holds()
    assert near.state()[0].position == pytest.approx((0.0, 0.0, 0.6), abs=1e-3)
    assert far.state()[0].position[2] < 0.1
    suction.on = False
    suck(world, suction, 4000)  # half of it is in the other one, which contacts end at 0.01 m/s
    assert not suction.holds()
    assert abs(near.state()[0].position[2] - 0.6) > 0.03


def test_a_suction_asks_once_a_tick_where_it_is(world, monkeypatch):
    lift = world.spawn("gripper", parse_urdf(gripper()), Pose())
    for name, y in (("a", 0.5), ("b", 1.0), ("c", 1.5)):
        world.spawn(name, parse_urdf(cube()), Pose((0.0, y, 0.1)))
    suction, asked, ask = Suction(world, lift, "lift_link"), [], lift.link_state
    monkeypatch.setattr(lift, "link_state", lambda link: asked.append(link) or ask(link))
    suction.on = True
    suction.update(0)
    assert asked == ["lift_link"]


RULE = GripRule(math.radians(120.0), threshold=2, most=5, release=0.005)


def grasping(world, text, place, mass=0.05):
    """A gripper around a cube, and `press(effort, looks)`, which closes it."""
    robot = world.spawn("gripper", parse_urdf(text), Pose())
    robot.set_motor("lift", 0.0, 1e4)
    box = world.spawn("cube", parse_urdf(cube(mass)), Pose(place))
    hold = GraspHold(world, robot, "lift_link", ["left_link", "right_link"], RULE)

    def press(effort, looks, ticks=100):
        for look in range(looks):
            for _ in range(ticks):
                robot.body.add_effort(robot.joint_index("left"), effort)
                world.step()
            hold.look(look)

    return robot, box, hold, press


def test_what_opposing_fingers_grip_stays_until_they_open(world):
    """Also while they have no force."""
    robot, box, hold, press = grasping(world, gripper(), (0.0, 0.0, 0.025), 0.1)
    press(2.0, 2)
    assert not world.attachments
    press(2.0, 5)
    assert len(world.attachments) == 1
    robot.set_motor("lift", 0.1, 1e4)
    run(world, 1000)
    assert box.state()[0].position[2] == pytest.approx(0.125, abs=2e-3)
    press(-2.0, 3)
    assert not world.attachments
    press(2.0, 1)
    world.reset(joints=True)
    hold.look(0)


def test_one_finger_grips_nothing(world):
    *_, press = grasping(world, gripper(mimic=""), (0.0, 0.03, 0.025))
    press(0.3, 10, 20)
    assert not world.attachments


def test_after_a_reset_a_grip_takes_as_long_as_the_first_one(world, monkeypatch):
    silence(monkeypatch)
    arm = "<palm_link>lift_link</palm_link>"
    arm += "".join(f"<gripper_link>{side}_link</gripper_link>" for side in ("left", "right"))
    fix = plugin("libgazebo_grasp_fix.so", arm=arm, update_rate=10)
    sim = Simulator(world, lockstep=True)
    robot = world.spawn("gripper", parse_urdf(gripper(more=fix)), Pose())
    PluginRegistry(sim, None).load(robot, "/")
    robot.set_motor("lift", 0.0, 1e4)
    world.spawn("cube", parse_urdf(cube(0.1)), Pose((0.0, 0.0, 0.025)))
    left = robot.joint_index("left")
    sim.listeners.append(lambda now: robot.body.add_effort(left, 2.0))

    def ticks_until_held():
        return sim.advance(2000, lambda: bool(world.attachments))

    first = ticks_until_held()
    assert 500 < first < 2000
    for _ in range(2):
        sim.reset_simulation()
        sim.advance(first - 150)
        assert not world.attachments
        sim.reset_simulation()
        assert ticks_until_held() == first
