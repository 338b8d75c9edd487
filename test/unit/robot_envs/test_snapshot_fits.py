"""What a file of a snapshot fits: how it was written doesn't matter, and what decides the future does."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest
import yaml
from support.robots import grippers
from support.scenes.play import play

import robot_envs.robots  # noqa: F401 - registers the environments
from cartpole.robot import ROBOT
from cartpole.tasks import SwingUpTask
from robot_envs import EnvSnapshot, Pose, Robot, RobotEnv, SimulatorError, StateQuery, Task
from robot_sim.physics.description import Light
from robot_sim.state_dict import StateError

WALKER = """<sdf version="1.6"><world name="w"><actor name="walker"><link name="body"/>
<script><trajectory id="0" type="walk"><waypoint><time>0</time><pose>5 0 1 0 0 0</pose></waypoint>
<waypoint><time>100</time><pose>{} 0 1 0 0 0</pose></waypoint></trajectory></script></actor></world></sdf>"""


@pytest.fixture
def made():
    """Makes an environment in its first step."""
    envs = []

    def make(robot=ROBOT, task=None, **options) -> RobotEnv:
        env = RobotEnv(robot, task or SwingUpTask(), backend="bullet", **options)
        envs.append(env)
        env.reset(seed=1)
        return env

    yield make
    for each in envs:
        each.close()


def filed(env) -> EnvSnapshot:
    return EnvSnapshot.from_bytes(env.save_state().to_bytes())


def configured(identifier: str, made, change) -> tuple[RobotEnv, RobotEnv]:
    """An environment, and one whose robot has other parameters."""
    with gymnasium.make(identifier) as env:
        task, robot = type(env.unwrapped.task), env.unwrapped.scene.robots[0]
    parameters = yaml.safe_load(Path(robot.controllers()).read_text(encoding="utf-8"))
    change(parameters)
    return made(robot, task()), made(replace(robot, controllers=parameters), task())


def exchange(parameters) -> None:
    for joint, other in (("shoulder", "elbow"), ("elbow", "shoulder")):
        parameters[f"{joint}_controller"]["joint"] = other


@pytest.mark.parametrize(
    ("identifier", "change"),
    [
        ("robot_envs/TwoLinkReach-v0", exchange),
        ("robot_envs/TwoLinkReach-v0", lambda given: given["elbow_controller"]["pid"].update(p=0.7)),
        ("robot_envs/TwoLinkReach-v0",
         lambda given: given.update(joint_limits={"elbow": {"has_effort_limits": True, "max_effort": 0.1}})),
        ("robot_envs/Navigate-v0", lambda given: given["drive_controller"].update(cmd_vel_timeout=0.05)),
    ],
)  # fmt: skip
def test_other_joints_gains_limits_and_settings_of_controllers_dont_fit(made, identifier, change) -> None:
    one, other = configured(identifier, made, change)
    with pytest.raises(SimulatorError, match="controllers, gains or limits aren't those of the snapshot"):
        other.restore_state(filed(one))
    one.restore_state(filed(one))


class Lifting(Task):
    def action_space(self):
        return gymnasium.spaces.Box(-1.0, 1.0, (1,))

    def observation_space(self):
        return gymnasium.spaces.Box(-9.0, 9.0, (1,))

    def apply(self, action, state):
        return {"lift": float(action[0])}

    def observe(self, state):
        return np.array([each.position for each in state.joints.values()][:1], np.float32)

    def reward(self, state, action):
        return 0.0


FOLLOWER = {"p": 100.0, "i": 5.0, "d": 0.1}


@pytest.mark.parametrize("other", [{"right": {**FOLLOWER, "p": 50.0}}, {"lift": {"p": 9.0}}, {"right": None}])
def test_other_gains_of_drives_and_followers_dont_fit(made, other) -> None:
    follower = grippers.plugin(
        "libroboticsgroup_upatras_gazebo_mimic_joint_plugin.so", joint="left", mimicJoint="right", hasPID=""
    )
    hand = grippers.gripper(mimic="", more=grippers.plugin("libgazebo_ros_control.so") + follower)
    lift = {"type": "velocity_controllers/JointVelocityController", "joint": "lift"}

    def lifting(gains) -> RobotEnv:
        kept = {"gazebo_ros_control": {"pid_gains": {name: each for name, each in gains.items() if each}}}
        return made(Robot(urdf=hand, controllers={"lift": lift, **kept}, run=("lift",)), Lifting())

    one, another = lifting({"right": FOLLOWER}), lifting({"right": FOLLOWER, **other})
    snapshot = filed(one)
    with pytest.raises(SimulatorError, match="controllers, gains or limits"):
        another.restore_state(snapshot)
    one.restore_state(snapshot)


def test_a_file_of_the_beginning_fits_where_a_control_period_has_begun(made) -> None:
    xml, found = re.subn(
        r"(<plugin[^>]*libgazebo_ros_control.so[^/>]*)/?>(</plugin>)?",
        r"\1><controlPeriod>0.004</controlPeriod></plugin>", ROBOT.xml,
    )  # fmt: skip
    assert found == 1
    env = made(replace(ROBOT, urdf=xml, control_period=0.02))
    begun = filed(env)
    first = play(env)
    env.restore_state(begun)
    assert play(env) == first


def test_it_does_not_depend_on_how_numbers_are_printed(made) -> None:
    given = filed(made())
    with np.printoptions(precision=3, suppress=True):
        made().restore_state(given)
    wider = SwingUpTask()
    wider.observation_space = lambda: gymnasium.spaces.Box(-9.0, 9.0, (5,), np.float32)
    with pytest.raises(ValueError, match="its spaces is"):
        made(task=wider).restore_state(given)


@pytest.mark.parametrize("place", [(1, 0, 0), (1.0, -0.0, 0.0), tuple(np.array([1.0, 0.0, 0.0]))])
def test_it_does_not_depend_on_how_a_pose_was_written(made, place) -> None:
    one, other = (made(replace(ROBOT, pose=Pose(each))) for each in ((1.0, 0.0, 0.0), place))
    first = play(one)
    one.reset(seed=1)
    other.restore_state(filed(one))
    assert play(other) == first


def test_other_lights_dont_fit(made) -> None:
    env, other = made(), made()
    snapshot = filed(env)
    world = other.backend._sim.world
    world.lights["sun"] = Light("sun", (0.2, 0.2, 0.2, 1.0), kind="directional")
    world.version += 1
    with pytest.raises(SimulatorError, match="lights aren't those of the snapshot"):
        other.restore_state(snapshot)


def test_lights_of_a_world_file_are_those_of_an_environment(made) -> None:
    light = "<light name='sun' type='directional'><diffuse>0.3 0.3 0.3 1</diffuse></light>"
    env = made(replace(ROBOT, world=f"<sdf version='1.6'><world name='w'>{light}</world></sdf>"))
    assert [each.diffuse[:3] for each in env.backend._sim.world.lights.values()] == [(0.3, 0.3, 0.3)]


class Watching(SwingUpTask):
    query = StateQuery(models=("walker",))

    def observe(self, state):
        return np.append(super().observe(state)[:4], state.models["walker"].pose.position[0])


def test_actors_begin_anew_with_each_episode_and_another_script_doesnt_fit(made) -> None:
    one, other = (made(replace(ROBOT, world=WALKER.format(end)), Watching()) for end in (15, 25))
    first = play(one)
    one.reset(seed=1)
    assert play(one) == first
    snapshot = filed(one)
    with pytest.raises(SimulatorError, match="'walker' has another description"):
        other.restore_state(snapshot)
    ahead = play(one)
    one.reset(seed=1)
    one.restore_state(snapshot)
    assert play(one) == ahead


def test_noise_of_joints_in_another_order_doesnt_fit(made) -> None:
    noise = {"stand_cart": 0.01, "cart_pole": 0.02}
    snapshot = filed(made(sensor_noise=noise))
    with pytest.raises(ValueError, match="its sensor_noise is"):
        made(sensor_noise=dict(reversed(noise.items()))).restore_state(snapshot)


def test_a_generator_takes_no_state_of_another_kind(made) -> None:
    env, other = made(), made()
    other.np_random = np.random.Generator(np.random.Philox(1))
    for snapshot in (env.save_state(), filed(env)):
        with pytest.raises(SimulatorError, match="a generator takes no state of the kind PCG64"):
            other.restore_state(snapshot)


def test_what_could_not_be_found_again_is_refused_when_it_is_written(made) -> None:
    @dataclass
    class Local:
        number: int = 1

    env = made()
    env.task.local = Local()
    env.restore_state(env.save_state())
    with pytest.raises(StateError, match="Local couldn't be found again by this name"):
        env.save_state().to_bytes()
