"""Environments with simulators of their own: the bits, and what becomes of one that fails."""

import gc
import logging
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import gymnasium
import pytest
import rospy
import yaml
from support.robots.cartpole import RICH
from support.scenes.rover import ROVER, Roll
from support.scenes.two_arms import LEFT, RIGHT, Volley

import cartpole  # noqa: F401  # registers the environments
from cartpole.robot import ROBOT
from cartpole.tasks import BalanceTask
from robot_envs import EnvSnapshot, RobotEnv
from robot_envs.backends.backend import Slot, side_by_side
from robot_envs.backends.ros.own_simulator import OwnSimulator
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.testing import check_robot_env, differences, rollout

pytestmark = pytest.mark.slow
BALANCE = "cartpole/Balance-v0"
HANG = 3.0  # [s] without an answer
BOUND = 120.0  # [s] for anything on a busy machine


def own(**options) -> RobotEnv:
    """The environment and its world; wrappers don't matter here."""
    return gymnasium.make(BALANCE, backend="ros-own", **options).unwrapped


def lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2]
        return state.split()[0] not in "ZX"
    except OSError:
        return False


def gone(pids: list[int]) -> bool:
    deadline = time.monotonic() + BOUND
    while any(map(lives, pids)) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not any(map(lives, pids))


def end(env: RobotEnv, number: signal.Signals) -> None:
    os.kill(env.backend.simulator.pid, number)


class Interrupted:
    """Steps, before some of which something happens; that of odd ones comes between begin and end."""

    def __init__(self, env: gymnasium.Env) -> None:
        self._env, self._happens = env, {}
        self.action_space, self.reset, self._steps = env.action_space, env.reset, 0

    def before(self, step: int, what) -> None:
        self._happens[step] = what

    def step(self, action):
        if self._steps % 2:
            self._env.begin_step(action)
        self._happens.pop(self._steps, lambda: None)()
        self._steps += 1
        return self._env.step(action)


@pytest.fixture(scope="module")
def truth() -> list:
    """What the environment in this process tells."""
    env = gymnasium.make(BALANCE, **RICH)
    yield rollout(env, 60, seed=8)
    env.close()


@pytest.fixture(scope="module")
def env() -> Iterator[RobotEnv]:
    made = own(deadline=HANG, **RICH)
    yield made
    made.close()


def test_a_coarser_physics_step_gives_the_same_bits_as_in_process() -> None:
    rover = replace(ROVER, physics_step=0.004)
    with RobotEnv(rover, Roll()) as wanted, RobotEnv(rover, Roll(), "ros-own") as found:
        assert differences(rollout(found, 40, seed=8), rollout(wanted, 40, seed=8)) == ""


def test_an_episode_goes_on_over_ros_where_it_was_saved_in_this_process() -> None:
    """There a joint_state_controller runs, too, which claims nothing and here doesn't exist."""
    here, there = gymnasium.make(BALANCE).unwrapped, own()
    with here, there:
        here.reset(seed=1)
        here.step(0)
        there.restore_state(EnvSnapshot.from_bytes(here.save_state().to_bytes()))
        for _ in range(10):
            assert repr(there.step(1)) == repr(here.step(1))


def test_snapshots_of_bodies_that_touch_survive_the_simulator() -> None:
    def told(dies: bool) -> list:
        cube = "robot_envs.robots:robot_envs/PickCube-v0"
        env = gymnasium.make(cube, backend="ros-own").unwrapped
        with env:
            env.reset(seed=1)
            snapshot = env.save_state()
            seen = []
            for _ in range(2):
                env.action_space.seed(2)
                if dies:
                    end(env, signal.SIGKILL)
                seen.append([env.step(env.action_space.sample()) for _ in range(10)])
                env.restore_state(snapshot)
            assert env.backend.restarts == 2 * dies
        return seen

    wanted = told(dies=False)
    assert repr(wanted[0]) == repr(wanted[1])
    assert repr(told(dies=True)) == repr(wanted)


FORGETFUL = """
from robot_sim.control.controllers.forward import Forward
from robot_sim.control.hardware import EFFORT

class Forgetful(Forward):
    interface, type_name = EFFORT, "forgetful/Forgetful"
    @classmethod
    def create(cls, name, params, hardware):
        return cls(name, [hardware.joints["cart_pole"]])
    def state_dict(self):
        return {}
    def load_state_dict(self, state):
        raise RuntimeError("it has forgotten")
"""


def test_what_cannot_be_restored_is_said_and_the_episode_goes_on(tmp_path, monkeypatch) -> None:
    (tmp_path / "forgetful.py").write_text(FORGETFUL, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    known = yaml.safe_load(ROBOT.controllers().read_text(encoding="utf-8"))
    extra = {"type": "forgetful/Forgetful"}
    robot = replace(ROBOT, controllers={**known, "extra": extra}, run=(*ROBOT.run, "extra"))
    with RobotEnv(robot, BalanceTask(), backend="ros-own") as env, own() as other:
        for each in (env, other):
            each.reset(seed=1)
            each.step(0)
        with pytest.raises(SimulatorError, match="controllers"):
            env.restore_state(other.save_state())
        env.step(0)  # nothing has changed
        snapshot, before = env.save_state(), env.state
        env.step(1)
        with pytest.raises(SimulatorError, match="it has forgotten"):
            env.restore_state(snapshot)
        assert env.state == before  # all else is restored
        env.step(1)
        assert env.state.time == pytest.approx(before.time + env.control_period)


def test_an_episode_begins_at_a_snapshot_whose_simulator_has_died() -> None:
    with own() as env:
        env.reset(seed=1)
        env.step(0)
        snapshot = env.save_state()
        begun = [env.reset(seed=2, options={"snapshot": snapshot}), *map(env.step, [0, 1, 1])]
        end(env, signal.SIGKILL)
        again = [env.reset(seed=2, options={"snapshot": snapshot}), *map(env.step, [0, 1, 1])]
        assert repr(again) == repr(begun)
        assert env.backend.restarts == 1
    with pytest.raises(SimulatorError, match="was closed"):
        snapshot.to_bytes()


def test_side_by_side_each_has_the_bits_that_it_has_alone(truth, monkeypatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1/")  # nobody asks there
    monkeypatch.setenv("ROS_NAMESPACE", "elsewhere")
    with side_by_side(2):
        envs = [own(**RICH) for _ in range(2)]
    simulators = [each.backend.simulator for each in envs]
    pids = [each.pid for each in simulators]
    assert len({each.uri for each in simulators}) == 2
    assert str(simulators[1]).startswith("simulator 2 of 2 (master http://127.0.0.1:")
    assert not envs[0].shares_robot
    assert envs[0].own_robot_options == {}
    assert differences(rollout(envs[0], 60, seed=8), truth) == ""
    assert differences(rollout(envs[1], 60, seed=8), truth) == ""
    assert not rospy.core.is_initialized()
    with side_by_side(2):
        for each in envs:
            each.close()
    assert not any(map(lives, pids))
    with pytest.raises(gymnasium.error.ClosedEnvironmentError):
        envs[0].reset()
    envs[0].close()


def test_one_that_dies_or_hangs_is_replaced_and_no_bit_differs(env, truth, caplog) -> None:
    episode = Interrupted(env)
    pids, before = [env.backend.simulator.pid], env.backend.restarts
    episode.before(0, lambda: end(env, signal.SIGKILL))
    episode.before(21, lambda: end(env, signal.SIGSTOP))
    assert differences(rollout(episode, 60, seed=8), truth) == ""
    assert env.backend.restarts == before + 2
    warnings = [each for each in caplog.records if each.levelno == logging.WARNING]
    died, hung = (each.getMessage() for each in warnings)
    assert "it was ended by SIGKILL, as the kernel does where memory" in died
    assert "no answer within" in hung
    for told in (died, hung):
        assert told.startswith("the simulator (master http://127.0.0.1:")
        assert told.endswith("simulator.log); another one takes its place")
        assert "\n" not in told
    assert gone(pids)


def test_answers_that_cannot_be_are_faults(env, truth) -> None:
    """The world's step goes further than asked for, as somebody else's request would have it."""
    episode, before = Interrupted(env), env.backend.restarts
    episode.before(8, lambda: env.backend._perform(lambda world: world.act({})))
    assert differences(rollout(episode, 60, seed=8), truth) == ""
    assert env.backend.restarts == before + 1


def test_a_second_death_is_an_error_that_names_both_and_the_next_reset_begins_anew(
    env, truth, monkeypatch
) -> None:
    wait = OwnSimulator.wait

    def die(simulator: OwnSimulator) -> None:
        wait(simulator)
        os.kill(simulator.pid, signal.SIGKILL)

    env.reset(seed=1)
    first = env.backend.simulator
    end(env, signal.SIGKILL)
    with monkeypatch.context() as patch:
        patch.setattr(OwnSimulator, "wait", die)
        with pytest.raises(SimulatorError) as raised:
            env.step(env.action_space.sample())
    text = str(raised.value)
    assert text.count("it was ended by SIGKILL") == 2
    assert first.uri in text and str(first.log) in text
    assert env.backend.simulator.uri in text and str(env.backend.simulator.log) in text
    assert "\n" not in text
    with pytest.raises(SimulatorError, match=r"no episode; begin one with reset\(\)"):
        env.backend.act({})
    assert differences(rollout(env, 60, seed=8), truth) == ""


def test_one_that_dies_before_its_robot_is_there_is_replaced(truth, monkeypatch, caplog) -> None:
    wait, killed = OwnSimulator.wait, []

    def die(simulator: OwnSimulator) -> None:
        wait(simulator)
        if not killed:
            killed.append(simulator.pid)
            os.kill(simulator.pid, signal.SIGKILL)

    monkeypatch.setattr(OwnSimulator, "wait", die)
    made = own(**RICH)
    assert killed and made.backend.restarts == 1
    assert "another one takes its place" in caplog.messages[-1]
    assert differences(rollout(made, 60, seed=8), truth) == ""
    made.close()


def test_worlds_robots_and_objects_come_back_too(tmp_path: Path) -> None:
    """Two arms with a ball in a world of their own, and what a state tells beside joints."""
    here = RobotEnv([LEFT, RIGHT], Volley(tmp_path), "bullet")
    there = RobotEnv([LEFT, RIGHT], Volley(tmp_path), "ros-own")
    episode = Interrupted(there)
    episode.before(20, lambda: end(there, signal.SIGKILL))
    assert differences(rollout(episode, 130, seed=7), rollout(here, 130, seed=7)) == ""
    assert there.backend.restarts == 1
    there.close()


def test_one_that_cannot_start_says_why_and_those_beside_it_end(monkeypatch) -> None:
    with pytest.raises(RobotEnvError) as raised, side_by_side(2):
        beside = own()
        monkeypatch.setenv("GZSERVER_ARGS", "--seed nonsense")
        own()
    assert not beside.backend.simulator.is_alive
    text = str(raised.value)
    assert text.startswith("simulator 2 of 2 (master http://127.0.0.1:")
    assert "it ended with exit code 2, it said last 'gzserver: error: argument --seed" in text
    assert text.count("\n") == 0


def test_where_there_are_no_files_nothing_starts() -> None:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    lowest = max(map(int, os.listdir("/proc/self/fd"))) + 1
    held = [os.open("/dev/null", os.O_RDONLY) for _ in range(lowest)]
    os.close(held.pop())
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(held) + 2, limits[1]))
    try:
        with pytest.raises(RobotEnvError, match="simulator can't be started: Too many open files$"):
            OwnSimulator(Slot(), None, 0)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
        for each in held:
            os.close(each)


def test_one_that_is_dropped_ends() -> None:
    env = own()
    pid = env.backend.simulator.pid
    del env
    gc.collect()
    assert gone([pid])


CLIENT = """
import os, signal, sys, gymnasium, cartpole
from robot_envs.backends.backend import Slot, side_by_side
with side_by_side(2):
    envs = [gymnasium.make("cartpole/Balance-v0", backend="ros-own").unwrapped for _ in range(2)]
simulators = [env.backend.simulator for env in envs]
os.kill(simulators[1].pid, signal.SIGSTOP)
if os.fork() == 0:  # a child that has inherited all, and outlives its parent
    signal.alarm(100)
    signal.pause()
print(*(pid for each in simulators for pid in (each.pid, each._process.pid)), flush=True)
signal.pause()
"""


def test_no_simulator_outlives_its_client() -> None:
    """One that is killed, and one that is interrupted."""
    numbers = (signal.SIGKILL, signal.SIGINT)
    clients = [
        subprocess.Popen(
            [sys.executable, "-c", CLIENT], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            text=True, start_new_session=True,
        )
        for _ in numbers
    ]  # fmt: skip
    try:
        pids = []
        for client in clients:
            pids += [int(each) for each in client.stdout.readline().split()]
        assert len(pids) == 8
        for client, number in zip(clients, numbers, strict=True):
            os.kill(client.pid, number)
        for client in clients:
            client.wait(BOUND)
        assert gone(pids)
    finally:
        for client in clients:
            os.killpg(client.pid, signal.SIGKILL)  # the child, too
            client.stdout.close()


@pytest.mark.long
def test_it_keeps_what_environments_of_robots_promise() -> None:
    """Which makes some hundred simulators."""
    check_robot_env(BALANCE, ("ros-own",), steps=30)
