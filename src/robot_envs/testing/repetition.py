"""Checks of repeatability: by seed, in other instances, backends and vectors."""

import copy
import pickle
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv

from robot_envs.environment import RobotEnv
from robot_envs.errors import SimulatorError
from robot_envs.snapshot import EnvSnapshot
from robot_envs.testing.rollouts import Given, Subject, differences, expect_error, rollout, same

WORLDS, SEED = 3, 11
TRIES = 20  # actions, to find another one
ROUNDS = 3  # of snapshots


def seeding(subject: Subject) -> None:
    """The same seed and actions are bit-identical: again, after other episodes, in another instance."""
    with subject.made() as env:
        if not env.backend.deterministic:
            assert env.spec is None or env.spec.nondeterministic, (
                "it never gives the same bits again, and spec.nondeterministic doesn't say so"
            )
            return
        first = rollout(env, subject.steps, SEED)
        _expect_same(first, rollout(env, subject.steps, SEED), "the second time")
        rollout(env, 7, SEED + 1)
        _expect_same(first, rollout(env, subject.steps, SEED), "after other episodes")
    with subject.made() as other:
        _expect_same(first, rollout(other, subject.steps, SEED), "in another instance")


def _expect_same(first: Given, again: Given, when: str) -> None:
    difference = differences(first, again)
    assert not difference, f"the same seed and actions give other bits {when}: {difference}"


def two_phases(subject: Subject) -> None:
    """`begin_step` changes no bit; a reset drops the step, and no other action takes it."""
    with subject.made() as env:
        first = rollout(env, subject.steps, SEED)
        env.reset(seed=SEED)
        action = env.action_space.sample()
        env.begin_step(action)
        expect_error(lambda: env.begin_step(action), "begin_step() once more before step()", ValueError)
        samples = (env.action_space.sample() for _ in range(TRIES))
        other = next((each for each in samples if not same(each, action)), None)
        if other is not None:
            expect_error(lambda: env.step(other), "step() with another action than was begun", ValueError)
        again = rollout(env, subject.steps, SEED, two_phases=True)
        env.begin_step(action)  # dropped by close()
        difference = differences(first, again) if env.backend.deterministic else ""
        assert not difference, f"steps that are begun first give other bits: {difference}"


def snapshots(subject: Subject) -> None:
    """After `restore_state` the same actions are bit-identical, also across the ends of episodes."""
    with subject.made() as env:
        env.reset(seed=SEED)
        if not env.backend.deterministic:
            expect_error(env.save_state, "save_state() in real time", SimulatorError)
            return
        for round_ in range(ROUNDS):
            _go_on(env, round_, round_)
            snapshot = env.save_state()
            first = _go_on(env, subject.steps, SEED)
            for when in ("at once", "after other actions", "after another episode"):
                env.restore_state(snapshot)
                _expect_same(first, _go_on(env, subject.steps, SEED), f"from a snapshot, {when}")
                if when == "after other actions":
                    env.reset(seed=round_)
                _go_on(env, 5, round_)
        if not env.backend.shared:
            _in_another(subject, snapshot, first)


def _in_another(subject: Subject, snapshot: EnvSnapshot, first: Given) -> None:
    """Another environment takes the snapshot as bytes, before and after it has done something else."""
    with subject.made() as other:
        for when in ("at first", "after an episode"):
            other.restore_state(EnvSnapshot.from_bytes(snapshot.to_bytes()))
            given = _go_on(other, subject.steps, SEED)
            _expect_same(first, given, f"from a snapshot in another environment, {when}")
            other.reset(seed=SEED)


def _go_on(env: RobotEnv, steps: int, seed: int) -> Given:
    """Returns the results of seeded random actions; an ended episode is followed by the next one."""
    env.action_space.seed(seed)
    given: Given = []
    for _ in range(steps):
        given.append(env.step(env.action_space.sample()))
        if given[-1][2] or given[-1][3]:
            given.append(env.reset())
    return given


def backends(subject: Subject, other: Subject) -> None:
    """Two backends are bit-identical."""
    runs = []
    for each in (subject, other):
        with each.made() as env:
            runs.append(rollout(env, subject.steps, SEED))
    difference = differences(*runs)
    assert not difference, f"{subject.backend} and {other.backend} give other bits: {difference}"


def specification(subject: Subject) -> None:
    """The spec can be copied, pickled, and made again."""
    if subject.identifier is None:
        return
    with subject.made() as env:
        first, _ = env.reset(seed=SEED)
        deterministic = env.backend.deterministic
        assert env.spec is not None  # it has an id
        try:
            spec = copy.deepcopy(env.spec)
            pickle.dumps(spec)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise AssertionError(f"its spec can't be copied and sent: {error}") from error
    again = gymnasium.make(spec)
    second, _ = again.reset(seed=SEED)
    again.close()
    assert same(first, second) or not deterministic, (
        f"made again from its spec it begins with {second!r}, and not with {first!r}"
    )


def vectors(subject: Subject) -> None:
    """Environments in a vector are bit-identical to environments alone."""
    alone = []
    for index in range(WORLDS):
        with subject.made() as env:
            alone.append(_run(env, index, subject.steps))
    for vector, kind in _vectors(subject):
        try:
            together = _run_all(vector, subject.steps)
        finally:
            vector.close()
        for index, (mine, theirs) in enumerate(zip(alone, together, strict=True)):
            for step, (one, other) in enumerate(zip(mine, theirs, strict=True)):
                assert same(one, other), (
                    f"environment {index} of {WORLDS} in a vector ({kind}) gives after {step} steps "
                    f"{other!r}, and alone {one!r}"
                )


def _vectors(subject: Subject) -> list[tuple[VectorEnv, str]]:
    if subject.identifier is None:
        one = partial(subject.make, **subject.options)
        return [(SyncVectorEnv([one] * WORLDS), "SyncVectorEnv")]
    kinds = ["sync"]
    plain = subject.identifier.rpartition(":")[2]  # its module has been imported to make it
    if gymnasium.spec(plain).vector_entry_point is not None:
        kinds.append("vector_entry_point")
    make = partial(gymnasium.make_vec, subject.identifier, WORLDS, **subject.options)
    return [(make(vectorization_mode=kind), f"make_vec, {kind}") for kind in kinds]


def _run(env: gymnasium.Env[Any, Any], index: int, steps: int) -> list[Any]:
    """Returns the results of one environment alone; the step after an end is a reset, as in a vector."""
    env.action_space.seed(SEED)
    given: list[Any] = [env.reset(seed=SEED + index)[0]]
    ended = False
    for _ in range(steps):
        action = [env.action_space.sample() for _ in range(WORLDS)][index]
        if ended:
            given.append((env.reset()[0], 0.0, False, False))
        else:
            observation, reward, *flags, _ = env.step(action)
            given.append((observation, float(reward), *flags))
        ended = any(given[-1][2:])
    return given


def _run_all(vector: VectorEnv, steps: int) -> list[list[Any]]:
    """Returns the same for all environments of a vector."""
    space = vector.single_action_space
    space.seed(SEED)
    seen, _ = vector.reset(seed=SEED)
    given: list[list[Any]] = [[_row(seen, index)] for index in range(WORLDS)]
    for _ in range(steps):
        actions = np.stack([space.sample() for _ in range(WORLDS)])
        seen, rewards, terminated, truncated, _ = vector.step(actions)
        ended = zip(rewards.tolist(), terminated.tolist(), truncated.tolist(), strict=True)
        for index, row in enumerate(ended):
            given[index].append((_row(seen, index), *row))
    return given


def _row(seen: Any, index: int) -> Any:
    if isinstance(seen, dict):
        return {key: _row(part, index) for key, part in seen.items()}
    return seen[index].copy()
