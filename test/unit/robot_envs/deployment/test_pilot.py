"""A policy at the controls: the same commands as in an environment, kept within limits; and how it stops."""

import math
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.scenes.rover import ROVER, Roll

import cartpole  # noqa: F401 - registers the environments
from robot_envs import GoalTask, JointState, LinkQuery, Robot, RobotEnv, StateQuery
from robot_envs.deployment.pilot import CommandLimits, Pilot, impossible
from robot_envs.errors import RobotEnvError
from robot_envs.robots.rover import ROBOT as TWO_WHEELED
from robot_sim.control.joint import JointLimits

FILES = Path(__file__).resolve().parents[3] / "data" / "robots"
PERIOD = 0.008  # [s] of the cart-pole's actions
CONTROLLER = "stand_cart_position_controller"


def sampled(env: gymnasium.Env, steps: int) -> list:
    env.action_space.seed(3)
    return [env.action_space.sample() for _ in range(steps)]


@pytest.mark.parametrize("identifier", ["cartpole/Balance-v0", "cartpole/SwingUp-v0"])
def test_it_commands_and_sees_what_an_environment_does(identifier: str) -> None:
    env = gymnasium.make(identifier).unwrapped
    sent, seen = [], []
    act = env.backend.act
    env.backend.act = lambda commands: (sent.append(dict(commands)), act(commands))[1]
    actions = sampled(env, 12)
    observation, _ = env.reset(seed=5)
    states = [env._state]
    for action in actions:
        seen.append(observation)
        observation, _, terminated, _, _ = env.step(action)
        states.append(env._state)
        assert not terminated
    found, again = [], iter(actions)
    act = lambda each: (found.append(each), next(again))[1]  # noqa: E731
    pilot = Pilot(env.scene.robots[0], type(env.task)(), act, PERIOD)
    pilot.begin(states[0].joints)
    commands = [pilot.step(state.time, state.joints) for state in states[:-1]]
    assert commands == sent
    assert np.array_equal(found, seen)
    env.close()


def test_it_stops_where_an_episode_would_be_over_and_goes_on_from_there() -> None:
    env = gymnasium.make("cartpole/Balance-v0").unwrapped
    pilot = Pilot(env.scene.robots[0], env.task, lambda seen: 1, PERIOD)
    upright = {"stand_cart": JointState(0.1, 0.0, 0.0), "cart_pole": JointState(0.0, 0.0, 0.0)}
    fallen = upright | {"cart_pole": JointState(0.5, 0.0, 0.0)}
    pilot.begin(upright)
    assert pilot.step(0.0, upright) == {CONTROLLER: pytest.approx(0.12)}
    assert pilot.step(PERIOD, upright) == {CONTROLLER: pytest.approx(0.14)}
    assert pilot.step(2 * PERIOD, fallen) is None
    assert pilot.stop(fallen) == {CONTROLLER: 0.1}, "where the cart is"
    assert pilot.step(3 * PERIOD, fallen) is None
    assert pilot.step(4 * PERIOD, upright) == {CONTROLLER: pytest.approx(0.12)}
    env.close()


def test_what_only_the_reward_sees_need_not_be_known() -> None:
    pilot = Pilot(ROVER, Roll(), lambda seen: np.full(2, 0.5, np.float32), ROVER.control_period)
    still = {name: JointState(0.0, 0.0, 0.0) for name in ("left_axle", "right_axle")}
    pilot.begin(still)
    assert [pilot.step(n * 0.02, still) for n in range(2)] == [{"wheels": (5.0, 5.0)}] * 2
    asking = Roll()
    asking.query, asking.reward_query = asking.reward_query, asking.query
    with pytest.raises(RobotEnvError, match="what only the reward needs belongs into"):
        Pilot(ROVER, asking, lambda seen: seen, ROVER.control_period)


def test_commands_are_kept_within_the_stops_and_that_is_told_once() -> None:
    env = gymnasium.make("cartpole/SwingUp-v0").unwrapped
    said: list[str] = []
    right = np.ones(1, np.float32)
    pilot = Pilot(env.scene.robots[0], env.task, lambda seen: right, PERIOD, say=said.append)
    hanging = {"stand_cart": JointState(0.39, 0.0, 0.0), "cart_pole": JointState(3.1, 0.0, 0.0)}
    pilot.begin(hanging)
    sent = [pilot.step(n * PERIOD, hanging)[CONTROLLER] for n in range(30)]
    assert sent[-1] == 0.5 and max(sent) == 0.5, "the rail's end"
    assert said == [f"{CONTROLLER} is commanded beyond the limits of stand_cart: it is kept within"]
    env.close()


def arm(kind: str) -> Robot:
    """Two joints under one controller."""
    text = (FILES / "two_link_arm.urdf").read_text()
    text = text.replace('type="continuous"', 'type="revolute"')
    text = text.replace('effort="20"', 'effort="20" lower="-1" upper="2"').replace(
        'effort="10"', 'effort="10" lower="-0.5" upper="0.5"'
    )
    if kind.startswith("position"):
        text = text.replace("EffortJoint", "PositionJoint")
    if kind.startswith("velocity"):
        text = text.replace("EffortJoint", "VelocityJoint")
    described = {"type": kind, "joints": ["elbow", "shoulder"]}
    return Robot(text, {"both": described}, ("both",))


@pytest.mark.parametrize(
    ("kind", "wanted", "given", "stopped"),
    [
        ("position_controllers/JointGroupPositionController", (9.0, -9.0), (0.5, -1.0), (0.3, -0.2)),
        ("velocity_controllers/JointGroupVelocityController", (90.0, -90.0), (20.0, -20.0), (0.0, 0.0)),
        ("effort_controllers/JointGroupEffortController", (90.0, -90.0), (10.0, -20.0), (0.0, 0.0)),
    ],
)  # fmt: skip
def test_each_quantity_has_its_limits_and_its_stop(kind, wanted, given, stopped) -> None:
    robot = arm(kind)
    (port,) = robot.ports
    limits = CommandLimits(robot, port, way=float("inf"), period=0.01)
    assert limits(wanted, (0.0, 0.0)) == (given, ["elbow", "shoulder"])
    assert limits((0.1, -0.1), (0.0, 0.0)) == ((0.1, -0.1), [])
    joints = {"shoulder": JointState(-0.2, 3.0, 1.0), "elbow": JointState(0.3, -3.0, 1.0)}
    assert limits.stop(joints) == stopped


def test_a_vehicle_is_kept_within_its_controllers_limits_and_stops_at_once() -> None:
    (port,) = TWO_WHEELED.ports
    limits = CommandLimits(TWO_WHEELED, port, 1.0, 0.2)
    held = limits.stop({})
    assert held == (0.0, 0.0, 0.0)
    assert limits((0.3, 0.0, -1.0), held) == ((0.3, 0.0, -1.0), [])
    cut = ["linear.x", "linear.y", "angular.z"]
    assert limits((3.0, 1.0, -9.0), held) == ((0.8, 0.0, -2.0), cut)


def test_positions_go_no_faster_than_their_joints_can() -> None:
    robot = arm("position_controllers/JointGroupPositionController")
    (port,) = robot.ports
    limits = CommandLimits(robot, port, way=0.5, period=0.01)  # half of 20 rad/s
    assert limits((0.4, -0.4), (0.0, 0.0)) == (pytest.approx((0.1, -0.1)), [])
    assert limits((0.4, 0.05), (0.35, 0.0)) == (pytest.approx((0.4, 0.05)), [])


def test_after_a_state_beyond_a_stop_commands_are_within_at_once_and_so_is_the_stop() -> None:
    robot = arm("position_controllers/JointGroupPositionController")
    (port,) = robot.ports
    limits = CommandLimits(robot, port, way=0.5, period=0.01)
    beyond = {"shoulder": JointState(-50.0, 0.0, 0.0), "elbow": JointState(1e300, 0.0, 0.0)}
    assert limits.stop(beyond) == (0.5, -1.0)
    assert limits((0.0, 0.0), (1e300, -50.0))[0] == (0.5, -1.0)


RAIL = JointLimits(lower=-0.5, upper=0.5, velocity=2.0)


@pytest.mark.parametrize(
    ("limits", "position", "velocity", "fault"),
    [
        (RAIL, 0.59, 19.0, ""),
        (RAIL, 50.0, 0.0, "beyond its stops at -0.5 and 0.5"),
        (RAIL, -0.7, 0.0, "beyond its stops"),
        (RAIL, 0.0, 21.0, "velocity 21, where its limit is 2"),
        (RAIL, math.nan, 0.0, "which no joint has"),
        (JointLimits(), 1e300, 0.0, "which no joint has"),
        (JointLimits(), 700.0, -90.0, ""),
        (JointLimits(lower=-1.0, velocity=0.0), -700.0, -90.0, ""),
    ],
)
def test_what_no_joint_can_do_is_known(limits, position, velocity, fault) -> None:
    found = impossible(limits, position, velocity)
    assert fault in found and bool(fault) == bool(found)


class ReachGoal(GoalTask):
    query = StateQuery(links=(LinkQuery("tip"),))

    def action_space(self):
        return gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def observation_space(self):
        return gymnasium.spaces.Box(-9.0, 9.0, (2,))

    def goals(self):
        return gymnasium.spaces.Box(-2.0, 2.0, (3,), np.float64)

    def goal(self, rng, state):
        return rng.uniform(-1.0, 1.0, 3)

    def achieved(self, state):
        return np.array(state.links["tip"].pose.position)

    def is_success(self, achieved, desired):
        return np.linalg.norm(achieved - desired, axis=-1) < 0.02

    def apply(self, action, state):
        return {"both": tuple(map(float, action))}

    def observe(self, state):
        return [each.position for each in state.joints.values()]


def test_goals_are_drawn_or_given() -> None:
    robot = arm("effort_controllers/JointGroupEffortController")
    seen: list[dict] = []
    pilot = Pilot(robot, ReachGoal(), lambda each: (seen.append(each), np.ones(2))[1], 0.01, seed=4)
    joints = {"shoulder": JointState(0.0, 0.0, 0.0), "elbow": JointState(0.0, 0.0, 0.0)}
    pilot.begin(joints)
    pilot.step(0.0, joints)
    pilot.aim([0.1, 0.2, 0.3])
    pilot.step(0.01, joints)
    assert seen[0]["achieved_goal"] == pytest.approx([0.5, 0.0, 0.6])
    assert np.array_equal(seen[0]["desired_goal"], np.random.default_rng(4).uniform(-1.0, 1.0, 3))
    assert np.array_equal(seen[1]["desired_goal"], [0.1, 0.2, 0.3])
    env = RobotEnv(robot, ReachGoal())
    assert env.observation_space.contains(seen[1])
    env.close()
    for wrong in ([3.0, 0.0, 0.0], [0.0], [float("nan")] * 3):
        with pytest.raises(ValueError, match="isn't one of ReachGoal's goals"):
            pilot.aim(wrong)
