#!/usr/bin/env python3
"""Legs: how well policies of the quadruped follow commands, and what its environment's steps cost.

    ./ws extras python3 benchmark/legs.py [--runs runs/sac,runs/ppo] [--env-backend bullet] [--episodes 100]

Of each run's best policy (`none`: actions of 0, the reference gait alone): episodes of 20 s with unseen
seeds and one command each, by turns ahead (0.5 to 0.8 m/s), to a side (0.5 to 0.6 m/s), a turn on the spot
(0.5 to 1 rad/s either way), and a curve (ahead with 0.3 to 0.6 rad/s). One succeeds if the robot never
falls, and from 2 s on moves on average at 0.4 m/s or more in the commanded direction, if that asks for
speed, and turns within 20 % of the commanded rate, if that asks for a turn.

Then steps a second of processor time: the environment's, with actions of 0, and those of a loop by hand in
the same engine, which computes torques for the gait's set-points by NumPy, and reads joints, trunk and
contacts after each control step. Prints tables and writes legs.json.
"""

import math
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import reporting
from all_robots import BATCH, rate

import robot_envs.robots  # noqa: F401 - registers the environments
from rl_workbench.tools.policies import TEST_SEED, load_learned
from rl_workbench.tools.runs import open_run
from robot_envs import RobotEnv
from robot_envs.robots.quadruped import HEIGHT, ROBOT
from robot_envs.robots.walking import WalkByCommand
from robot_sim.physics.engines.quiet_pybullet import pybullet

ID = "robot_envs/Quadruped-v0"
LEAST, WITHIN = 0.4, 0.2  # [m/s]; of a turn's rate
UNTIL = 100  # steps, after which speeds count
GAINS, EFFORT = (80.0, 1.3), 30.0
Act = Callable[[np.ndarray], np.ndarray]


class Walked(NamedTuple):
    """One episode."""

    kind: str
    command: tuple[float, float, float]
    velocity: tuple[float, float, float]  # mean, ahead, left [m/s], about [rad/s]
    fell: bool
    success: bool


def command(rng: np.random.Generator, kind: str) -> tuple[float, float, float]:
    way = float(rng.choice((-1.0, 1.0)))
    fast, aside, turn, bend = rng.uniform((0.5, 0.5, 0.5, 0.3), (0.8, 0.6, 1.0, 0.6)).tolist()
    return {
        "ahead": (fast, 0.0, 0.0),
        "aside": (0.0, way * aside, 0.0),
        "turn": (0.0, 0.0, way * turn),
        "curve": (fast, 0.0, way * bend),
    }[kind]


KINDS = ("ahead", "aside", "turn", "curve")


def walk(env: RobotEnv, act: Act, number: int) -> Walked:
    """Plays the episode of a number."""
    task = env.task
    assert isinstance(task, WalkByCommand)
    kind = KINDS[number % len(KINDS)]
    wanted = command(np.random.default_rng(TEST_SEED + number), kind)
    env.reset(seed=TEST_SEED + number)
    task.aim(wanted)
    assert env.state is not None
    seen = task.observe(env.state)  # with that command
    velocities, fell, ended = [], False, False
    while not ended:
        seen, _, fell, ended, info = env.step(act(seen))
        velocities.append(info["velocity"])
        ended = fell or ended
    ahead, left, about = np.mean(velocities[UNTIL:] or velocities, axis=0).tolist()
    speed = math.hypot(wanted[0], wanted[1])
    along = (ahead * wanted[0] + left * wanted[1]) / speed if speed else LEAST
    follows = not wanted[2] or abs(about - wanted[2]) <= WITHIN * abs(wanted[2])
    return Walked(kind, wanted, (ahead, left, about), fell, not fell and along >= LEAST and follows)


def made(backend: str) -> RobotEnv:
    env = gymnasium.make(ID, backend=backend).unwrapped
    assert isinstance(env, RobotEnv)
    return env


def evaluate(run: str, backend: str, episodes: int) -> list[Walked]:
    """Plays a run's best policy."""
    if run == "none":
        env, act = made(backend), lambda _: np.zeros(15, np.float32)
    else:
        player = load_learned(open_run(Path(run)), env_options={"backend": backend})
        assert isinstance(player.env.unwrapped, RobotEnv)
        env, act = player.env.unwrapped, player.act
    try:
        return [walk(env, act, number) for number in range(episodes)]
    finally:
        env.close()


def summary(walked: list[Walked]) -> dict[str, Any]:
    """Successes, falls, and mean absolute errors by kind."""
    rows = {}
    for kind in (*KINDS, "all"):
        own = [each for each in walked if kind in (each.kind, "all")]
        off = np.abs(np.array([np.subtract(each.velocity, each.command) for each in own]))
        rows[kind] = {
            "episodes": len(own), "successes": sum(each.success for each in own),
            "falls": sum(each.fell for each in own), "errors": off.mean(axis=0).tolist(),
        }  # fmt: skip
    return rows


def environment(backend: str) -> Callable[[], int]:
    env = made(backend)
    env.reset(seed=0)
    action = np.zeros(15, np.float32)

    def batch() -> int:
        for _ in range(BATCH):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return BATCH

    return batch


def targets() -> list[np.ndarray]:
    """The set-points of a period of the reference gait."""
    task = made("bullet").task
    assert isinstance(task, WalkByCommand)
    ahead = np.array((0.3, 0.0, 0.0))
    return [task.middle + task.gait.offsets(each / 20.0, ahead) for each in range(20)]


def bullet_by_hand() -> Callable[[], int]:
    call: dict[str, Any] = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
    pybullet.setGravity(0.0, 0.0, -9.8, **call)
    pybullet.setTimeStep(0.002, **call)
    pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE, **call), **call)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "robot.urdf")
        path.write_text(ROBOT.xml, encoding="utf-8")
        flags = pybullet.URDF_MERGE_FIXED_LINKS | pybullet.URDF_USE_INERTIA_FROM_FILE
        body = pybullet.loadURDF(str(path), (0.0, 0.0, HEIGHT), flags=flags, **call)
    joints = list(range(pybullet.getNumJoints(body, **call)))
    names = [pybullet.getJointInfo(body, each, **call)[1].decode() for each in joints]
    order = [ROBOT.ports[0].joints.index(name) for name in names]
    gait = [each[order] for each in targets()]
    for joint, at in zip(joints, gait[0], strict=True):
        pybullet.changeDynamics(body, joint, lateralFriction=0.8, **call)
        pybullet.resetJointState(body, joint, at, **call)
    free = dict.fromkeys(("forces",), [0.0] * len(joints))
    pybullet.setJointMotorControlArray(body, joints, pybullet.VELOCITY_CONTROL, **free, **call)
    k, d = GAINS

    def batch() -> int:
        for number in range(BATCH):
            wanted = gait[number % len(gait)]
            for _ in range(10):
                states = pybullet.getJointStates(body, joints, **call)
                at, speeds = np.array([each[:2] for each in states]).T
                forces = np.clip(k * (wanted - at) - d * speeds, -EFFORT, EFFORT)
                pybullet.setJointMotorControlArray(
                    body, joints, pybullet.TORQUE_CONTROL, forces=forces, **call
                )
                pybullet.stepSimulation(**call)
            pybullet.getJointStates(body, joints, **call)
            pybullet.getBasePositionAndOrientation(body, **call)
            pybullet.getBaseVelocity(body, **call)
            pybullet.getContactPoints(bodyA=body, **call)
        return BATCH

    return batch


def mujoco_by_hand() -> Callable[[], int]:
    import mujoco

    text = ROBOT.xml.replace("<link", '<mujoco><compiler fusestatic="false"/></mujoco><link', 1)
    spec = mujoco.MjSpec.from_string(text)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0))
    spec.body("base").add_freejoint()
    model = spec.compile()
    model.opt.timestep = 0.002
    model.geom_contype[1:] = 2  # touches the ground alone
    data = mujoco.MjData(model)
    names = [model.joint(each).name for each in range(1, model.njnt)]
    order = [ROBOT.ports[0].joints.index(name) for name in names]
    gait = [each[order] for each in targets()]
    data.qpos[2], data.qpos[7:] = HEIGHT, gait[0]
    places, speeds, (k, d) = data.qpos[7:], data.qvel[6:], GAINS

    def batch() -> int:
        for number in range(BATCH):
            wanted = gait[number % len(gait)]
            for _ in range(10):
                data.qfrc_applied[6:] = np.clip(k * (wanted - places) - d * speeds, -EFFORT, EFFORT)
                mujoco.mj_step(model, data)
            _ = data.qpos.copy(), data.qvel.copy(), list(data.contact)
        return BATCH

    return batch


def main() -> None:
    chosen = reporting.options(
        __doc__ or "", runs="none", env_backend="bullet", episodes=100, seconds=2.0, rounds=5
    )
    results: dict[str, Any] = {}
    for run in filter(None, chosen.runs.split(",")):
        rows = results[run] = summary(evaluate(run, chosen.env_backend, chosen.episodes))
        print(f"{run}\n{'':8} {'succeed':>10} {'fall':>5}   mean error ahead, left [m/s], about [rad/s]")
        for kind, row in rows.items():
            errors = "  ".join(f"{each:.2f}" for each in row["errors"])
            print(f"{kind:8} {row['successes']:4} of {row['episodes']:3} {row['falls']:5}   {errors}")
    pairs = {"bullet": bullet_by_hand, "mujoco": mujoco_by_hand}
    for engine, hand in pairs.items():
        batches, taken = (environment(engine), hand()), []
        for _ in range(chosen.rounds):
            taken.append([rate(each, chosen.seconds).processor for each in batches])
        own, other = (statistics.median(each[i] for each in taken) for i in (0, 1))
        share = statistics.median(a / b for a, b in taken)
        results[engine] = {"environment": own, "by hand": other, "share": share}
        print(f"{engine}: {own:,.0f} steps a second, by hand {other:,.0f}: {share:.0%}")
    reporting.write(chosen.out, "legs", results)


if __name__ == "__main__":
    main()
