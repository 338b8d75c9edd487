"""Files of snapshots: in fresh processes, and where somebody has changed them."""

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
from robot_sim.plain_data import pack, unpack
from robot_sim.snapshot import DIGEST, MAGIC, Snapshot, SnapshotError

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


def test_a_refused_file_of_another_variation_leaves_the_robot_as_it_was():
    def varied(seed, backend):
        env = gymnasium.make("cartpole/Balance-v0", randomisation={"mass": 0.5}, backend=backend).unwrapped
        env.reset(seed=seed)
        return env

    with varied(1, "bullet") as env, varied(1, "bullet") as same, varied(2, "mujoco") as other:
        same.save_state()
        data = other.save_state().to_bytes()
        with pytest.raises(SimulatorError, match="the engine .Mujoco., and here"):
            env.restore_state(EnvSnapshot.from_bytes(data))
        assert play(env) == play(same)


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


def own(robot, name):
    return robot["manager"]["controllers"][f"{name}_controller"]


LOST = "can't be restored: .*(pid|_joints|_loops|controller)"
NUMBERS = "numbers of gripper_arm's joints are missing"


@pytest.mark.parametrize(
    ("words", "change"),
    [
        (LOST, lambda robot: own(robot, "gripper")["pids"].update({"left_finger/pid": None})),
        (LOST, lambda robot: own(robot, "gripper")["_loops"].__setitem__(0, None)),
        (LOST, lambda robot: own(robot, "joint_state").pop("_joints")),
        (LOST, lambda robot: own(robot, "joint_state")["_joints"].pop()),
        (LOST, lambda robot: own(robot, "joint_state").update(_joints=None)),
        (NUMBERS, lambda robot: robot["efforts"].__setitem__(0, None)),
        (NUMBERS, lambda robot: robot["hardware"]["joints"]["wrist"].update(command=None)),
        (NUMBERS, lambda robot: robot["hardware"]["drives"]["wrist"].update(_most=None)),
    ],
)
def test_a_robot_loses_nothing_that_it_refers_to(words, change):
    env = begun("robot_envs/PickCube-v0", "bullet")
    good = env.save_state()
    with pytest.raises(SimulatorError, match=words):
        env.restore_state(altered(env, lambda state: change(state["robots"][0])))
    env.restore_state(good)
    env.close()


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
    with pytest.raises(SnapshotError, match="of another version"):
        EnvSnapshot.from_bytes(b"robot snapshot 2\n" + bytes(50))
