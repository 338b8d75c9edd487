"""Files of snapshots: in fresh processes, and where somebody has changed them."""

import contextlib
import dataclasses
import hashlib
import os
import random
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from support.scenes import play as script
from support.scenes.play import play

from cartpole.robot import ROBOT
from cartpole.tasks import SwingUpTask
from robot_envs import EnvSnapshot, RobotEnv, SimulatorError
from robot_envs.variation import Variation
from robot_envs.variation.variation import LinkScale
from robot_sim.physics.engines.bullet_body import BulletMotion
from robot_sim.physics.pose import Pose
from robot_sim.plain_data import pack, unpack
from robot_sim.snapshot import DIGEST, MAGIC, Snapshot, SnapshotError
from robot_sim.state_dict import StateError

BEGIN = len(MAGIC) + DIGEST
ODD = [
    None, True, -1, 2**62, 2**70, float("nan"), 1e300, "x", b"abc", [], (), {}, [1] * 50, np.zeros(3),
    np.zeros((0, 2)), {"__generator__": "seed", "state": 1, "seeds": None},
    {"__generator__": "PCG64", "state": {}, "seeds": [1, [], 10**9, 0]},
]  # fmt: skip


def begun(identifier, backend):
    env = gymnasium.make(identifier, backend=backend).unwrapped
    env.reset(seed=1)
    env.action_space.seed(2)
    for _ in range(5):
        env.step(env.action_space.sample())
    return env


IDS = [each for each in gymnasium.registry if each.startswith(("cartpole/", "robot_envs/"))]


@pytest.mark.parametrize("options", [{}, {"sensor_noise": 0.001, "sensor_delay": 2, "action_delay": 1}])
@pytest.mark.parametrize("identifier", IDS)
def test_files_of_any_moment_fit_at_any_other(identifier, options):
    env = gymnasium.make(identifier, **options).unwrapped
    env.action_space.seed(2)
    action, files, after = env.action_space.sample(), [], []
    for episode in range(2):
        env.reset(seed=episode)
        for _ in range(2):
            files.append(EnvSnapshot.from_bytes(env.save_state().to_bytes()))
            after.append(repr(env.step(action)))
    for _ in range(2):
        for file, first in zip(files, after, strict=True):
            env.restore_state(file)
            assert repr(env.step(action)) == first
    env.close()


@pytest.mark.extras("mujoco")
@pytest.mark.parametrize(
    ("identifier", "backend"), [("robot_envs/PickCube-v0", "mujoco"), ("robot_envs/Navigate-v0", "bullet")]
)
def test_a_fresh_process_goes_on_to_the_bit(identifier, backend, tmp_path):
    env = begun(identifier, backend)
    env.save_state().save(tmp_path / "there.snapshot")
    first = play(env)
    env.close()
    done = subprocess.run(
        [sys.executable, script.__file__, identifier, backend, str(tmp_path / "there.snapshot")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.rpartition("played ")[2].strip() == first


def test_an_environment_of_this_process_goes_on_from_a_file(tmp_path):
    env, other = (
        gymnasium.make("cartpole/Balance-v0", sensor_noise=0.01, sensor_delay=2).unwrapped for _ in range(2)
    )
    env.reset(seed=1)
    play(env)
    env.save_state().save(tmp_path / "hard.snapshot")
    first = play(env)
    other.restore_state(EnvSnapshot.load(tmp_path / "hard.snapshot"))  # before any reset
    assert play(other) == first
    other.reset(seed=5)
    other.restore_state(EnvSnapshot.load(tmp_path / "hard.snapshot"))
    assert play(other) == first
    with pytest.raises(SnapshotError, match=r"none\.snapshot: .*No such file"):
        EnvSnapshot.load(tmp_path / "none.snapshot")


def test_scripts_share_their_classes_with_the_processes_that_they_spawn(monkeypatch):
    class Short(SwingUpTask):
        def __init__(self):
            super().__init__()
            self.mark = None

    @dataclasses.dataclass
    class Mark:
        number: int

    envs = {}
    for module in ("__main__", "__mp_main__"):  # what spawned processes call the script, under both names
        Mark.__module__ = Short.__module__ = module
        Mark.__qualname__ = "Mark"
        monkeypatch.setattr(sys.modules["__main__"], "Mark", Mark, raising=False)
        envs[module] = RobotEnv(ROBOT, Short())
        envs[module].reset(seed=0)
        envs[module].task.mark = Mark(len(envs))
        if len(envs) == 1:
            data = envs[module].save_state().to_bytes()
    envs["__mp_main__"].restore_state(EnvSnapshot.from_bytes(data))
    assert envs["__mp_main__"].task.mark == Mark(1)


def test_varied_robots_are_varied_as_they_were():
    options = {"randomisation": {"mass": 0.3, "length": 0.2, "pole_friction": 0.01}}
    env = gymnasium.make("cartpole/Balance-v0", **options).unwrapped
    env.reset(seed=1)
    play(env)
    snapshot = env.save_state()
    first = play(env)
    env.reset(seed=9)
    env.restore_state(snapshot)
    assert play(env) == first
    env.close()


def test_a_link_that_was_varied_leaves_no_trace_in_later_episodes():
    """PyBullet loads a model with another centre of mass anew, as its last one."""
    env = begun("robot_envs/PickCube-v0", "bullet")
    own, first = env.save_state(), play(env)
    varied = gymnasium.make("robot_envs/PickCube-v0", randomisation={"com": 0.02}).unwrapped
    varied.reset(seed=1)
    env.reset(seed=5, options={"snapshot": varied.save_state()})
    env.reset(seed=1)
    for snapshot in (own, EnvSnapshot.from_bytes(own.to_bytes())):
        env.restore_state(snapshot)
        assert play(env) == first
    for each in (env, varied):
        each.close()


def places(value, place=()):
    """All places of a state that can be replaced."""
    if place:
        yield place
    entries = enumerate(value) if isinstance(value, list) else getattr(value, "items", list)()
    for key, each in entries:
        yield from places(each, (*place, key))


def signed(content):
    """A file of a snapshot, with the digest of what it holds."""
    return MAGIC + hashlib.sha256(content).digest() + content


def altered(env, change):
    """Its snapshot with a change of its state; its digest is right."""
    fits, state = unpack(env.save_state().to_bytes()[BEGIN:])
    change(state)
    return EnvSnapshot.from_bytes(signed(pack([fits, state])))


def forged(data, rng):
    """The same with an odd value somewhere, or with other bytes; its digest is right."""
    content = data[BEGIN:]
    if rng.random() < 0.6:
        state = unpack(content)
        *way, last = rng.choice(list(places(state)))
        target = state
        for key in way:
            target = target[key]
        target[last] = rng.choice(ODD)
        content = pack(state)
    else:
        changed = bytearray(content)
        for _ in range(rng.randint(1, 3)):
            changed[rng.randrange(len(changed))] = rng.randrange(256)
        content = bytes(changed)
    return signed(content)


def test_forged_files_run_no_code_and_are_one_error():
    env = begun("cartpole/Balance-v0", "bullet")
    good = env.save_state().to_bytes()
    modules, rng, refused = set(sys.modules), random.Random(1), 0
    for _ in range(300):
        try:
            env.restore_state(EnvSnapshot.from_bytes(forged(good, rng)))
        except (SnapshotError, SimulatorError, ValueError) as error:
            assert "\n" not in str(error)
            refused += 1
            env.restore_state(EnvSnapshot.from_bytes(good))
        else:  # another state, as good as any
            env.close()
            env = begun("cartpole/Balance-v0", "bullet")
    assert refused > 150 and set(sys.modules) == modules
    env.close()


def test_a_refused_one_changes_nothing():
    env, same = (begun("robot_envs/SixJointReach-v0", "bullet") for _ in range(2))
    state = unpack(env.save_state().to_bytes()[BEGIN:])
    same.save_state()
    for change in (
        lambda fits, state: fits.update(engine="Ode"),
        lambda fits, state: state["robots"].clear(),
        lambda fits, state: state["robots"][0]["hardware"]["joints"].clear(),
        lambda fits, state: state["environment"]["parts"].pop("task"),
        lambda fits, state: state["world"].update(models={}),
        lambda fits, state: state.pop("now"),
        lambda fits, state: [
            each.update(_joints=[], update=1)
            for each in state["robots"][0]["manager"]["controllers"].values()
            if "_commands" in each
        ],
    ):
        fits, content = unpack(pack(state))
        change(fits, content)
        with pytest.raises(SimulatorError):
            env.restore_state(EnvSnapshot.from_bytes(signed(pack([fits, content]))))
    assert play(env) == play(same)
    env.close()
    same.close()


NAN, HUGE, STILL = float("nan"), (1e300, 0.0, 0.0), ((0.0,) * 3, (0.0,) * 3)
CUBE, VARIED = "world models cube", "environment variation"
LOWER = "robots 0 hardware drives shoulder _limiter 1 _lower"
HARDWARE, MANAGED = "robots 0 hardware", "robots 0 manager controllers"
GRIPPER, JOINTS = f"{MANAGED} gripper_controller", f"{MANAGED} joint_state_controller"
FORGED = [
    (f"{CUBE} motion", BulletMotion(Pose((0.5, 0.0, 0.5), (0.0,) * 4), STILL, [])),
    (f"{CUBE} motion", BulletMotion(Pose((0.5, 0.0, 0.5), (1e10, 0.0, 0.0, 1.0)), STILL, [])),
    (f"{CUBE} motion", BulletMotion(Pose((0.5, 0.0, 0.5)), (HUGE, HUGE), [])),
    (f"{CUBE} placed", Pose((NAN, 0.0, 0.0))), ("robots 0 efforts 1", NAN), (LOWER, NAN), (LOWER, None),
    ("applied wrenches", [["cube", "cube", HUGE, HUGE, 0, 2**60]]), ("episode held", {}),
    (VARIED, Variation(surfaces={"none": 2.0})), (VARIED, Variation(gains={"arm_controller": NAN})),
    (VARIED, Variation(gravity=1e300)), (VARIED, Variation(links={"elbow": LinkScale(-1.0)})),
    (VARIED, Variation(gravity=2.0)), (VARIED, Variation(links=None)),
    ("environment steps", b"abc"), ("environment steps", -5), ("environment state", 5),
    ("environment first", {"none": 1.0}),
    (f"{HARDWARE} joints wrist command", None), (f"{HARDWARE} drives wrist _most", None),
    (f"{GRIPPER} pids left_finger/pid", None), (f"{GRIPPER} _loops 0", None),
    (f"{JOINTS} _joints", None), (f"{JOINTS} _joints", []), (f"{GRIPPER} _loops", []),
    (f"{CUBE} motion", BulletMotion(Pose(None), STILL, [])), (f"{CUBE} motion", None),
    ("resets", None), ("now", None), ("now", 2**62), ("now", -1), (f"{GRIPPER} pids", {}),
    ("environment parts task", {}), ("environment lent", ["cube"]),
]  # fmt: skip


def put(state, place, value):
    *way, last = [int(key) if key.isdigit() else key for key in place.split()]
    for key in way:
        state = state[key]
    state[last] = value


def test_forged_ones_harm_neither_the_episode_nor_those_after_it():
    env, fresh = begun("robot_envs/PickCube-v0", "bullet"), gymnasium.make("robot_envs/PickCube-v0").unwrapped
    good = env.save_state()
    after = play(env)
    for place, value in FORGED:
        env.restore_state(good)
        forged = altered(env, lambda state, place=place, value=value: put(state, place, value))
        for each in (env, fresh):
            with pytest.raises(SimulatorError, match=r"^[^\n]+$"):
                each.restore_state(forged)
                pytest.fail(f"{place} may be {value}")
        assert play(env) == after, place
        with contextlib.suppress(SimulatorError):
            env.reset(options={"snapshot": forged})
        env.reset(seed=1)
    for each in (env, fresh):
        each.restore_state(good)
        assert play(each) == after
        each.close()


class Marked(SwingUpTask):
    """A user's task."""


def test_a_tasks_attributes_may_be_of_another_type_in_a_file():
    env = RobotEnv(ROBOT, Marked())
    env.reset(seed=1)
    for there, later in [(0, 2**70), (0, NAN), ([], np.zeros(3)), (False, 3), (0, "done"), (0.0, {})]:
        env.task.mark = later
        snapshot = EnvSnapshot.from_bytes(env.save_state().to_bytes())
        env.task.mark = there
        env.restore_state(snapshot)
        assert type(env.task.mark) is type(later)


def test_those_of_another_robot_or_engine_leave_the_episode_as_it_is(tmp_path):
    xml = tmp_path / "rod.urdf"
    xml.write_text(ROBOT.xml.replace('name="pole"', 'name="rod"').replace('link="pole"', 'link="rod"'))
    robots = [dataclasses.replace(ROBOT, urdf=xml), dataclasses.replace(ROBOT, engine="mujoco"), ROBOT, ROBOT]
    *others, env, same = [RobotEnv(robot, SwingUpTask(), randomisation={"mass": 0.3}) for robot in robots]
    for seed, each in enumerate((*others, env, same)):
        each.reset(seed=min(seed, 2))
    same.save_state()
    for other in others:
        live = other.save_state()
        for snapshot in (live, EnvSnapshot.from_bytes(live.to_bytes())):
            with pytest.raises(SimulatorError, match="no link 'rod'|the engine .Mujoco."):
                env.restore_state(snapshot)
    assert play(env) == play(same)
    assert np.array_equal(env.reset(seed=3)[0], same.reset(seed=3)[0])


def test_what_cannot_be_written_leaves_an_older_file(tmp_path, monkeypatch):
    path = tmp_path / "there.snapshot"
    Snapshot({}, {"a": 1}).save(path)
    before = path.read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: 1 / 0)
    for content, error in (([None] * 2**22, StateError), (1, ZeroDivisionError)):
        with pytest.raises(error):
            Snapshot({}, {"a": content}).save(path)
    assert path.read_bytes() == before and [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize(
    "change",
    [
        lambda own: own.pop("variation"), lambda own: own.update(variation=[1]),
        lambda own: own.pop("initial"), lambda own: own.update(initial=5),
    ],
)  # fmt: skip
def test_no_episode_begins_at_a_forged_one(change):
    env = begun("cartpole/Balance-v0", "bullet")
    forged = altered(env, lambda state: change(state["environment"]))
    with pytest.raises(SimulatorError, match="^no episode can begin at the snapshot: "):
        env.reset(options={"snapshot": forged})
    env.close()


@pytest.mark.parametrize(
    "make", [os.mkfifo, lambda path: path.mkdir(), lambda path: path.symlink_to("/dev/zero")]
)
def test_what_is_no_file_is_refused_at_once(make, tmp_path):
    make(tmp_path / "odd.snapshot")
    with pytest.raises(SnapshotError, match=r"odd\.snapshot"):
        EnvSnapshot.load(tmp_path / "odd.snapshot")


def test_a_simulators_snapshot_and_another_version_are_named():
    with pytest.raises(SnapshotError, match="a simulator's, not an environment's"):
        EnvSnapshot.from_bytes(Snapshot({}, {}).to_bytes())
    with pytest.raises(SnapshotError, match="an array in what it fits"):
        Snapshot.from_bytes(Snapshot({"engine": np.zeros(2)}, {}).to_bytes())
    with pytest.raises(SnapshotError, match="of another version"):
        EnvSnapshot.from_bytes(b"robot snapshot 1\n" + bytes(50))


def test_a_file_of_the_same_task_with_other_spaces_is_refused_and_the_episode_goes_on() -> None:
    few, many = (gymnasium.make("robot_envs/Navigate-v0", ranges=number).unwrapped for number in (24, 36))
    few.reset(seed=0)
    many.reset(seed=0)
    with pytest.raises(ValueError, match="its spaces is"):
        many.restore_state(EnvSnapshot.from_bytes(few.save_state().to_bytes()))
    many.step(many.action_space.sample())
    few.close()
    many.close()
