"""Vectors of robots in this process: each as if it were alone; and what can go wrong. Over ROS: test/ros."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence as same
from support.robots.cartpole import IDS, RICH

import cartpole  # noqa: F401 - registers the environments
import robot_envs.robots  # noqa: F401 - the same of others
from robot_envs.errors import RobotEnvError, TaskError
from robot_envs.vector import RobotVectorEnv

COUNT = 4
OPTIONS = {"max_steps": 40, **RICH}


def vector_rollout(env, steps=100):
    env.action_space.seed(5)
    given = [env.reset(seed=9)]
    given += [env.step(env.action_space.sample()) for _ in range(steps)]
    env.close()
    return given


@pytest.fixture
def many():
    vectors = []

    def make(identifier="cartpole/Classic-v0", num_envs=2, **options):
        vectors.append(gymnasium.make_vec(identifier, num_envs, **options))
        return vectors[-1]

    yield make
    for each in vectors:
        each.close()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_all_ways_give_the_same_bits(mode):
    identifier = IDS[mode == "SameStep"]
    ours = gymnasium.make_vec(identifier, COUNT, autoreset_mode=mode, **OPTIONS)
    of_gymnasium = [
        gymnasium.make_vec(identifier, COUNT, kind, {"autoreset_mode": mode}, **OPTIONS)
        for kind in ("sync", "async")
    ]
    assert isinstance(ours.unwrapped, RobotVectorEnv)
    first, *others = [vector_rollout(env) for env in (ours, *of_gymnasium)]
    for other in others:
        assert all(same(a, b, exact=True) for a, b in zip(first, other, strict=True))


def test_only_the_masked_are_reset_where_episodes_end_apart(many):
    vector = many(num_envs=COUNT, autoreset_mode="Disabled")
    vector.reset(seed=1)
    before = vector.step(np.ones(COUNT, int))[0]
    mask = np.array([True, False, False, True])
    options = {"reset_mask": mask}
    after, _ = vector.reset(seed=[7] * COUNT, options=options)
    assert options == {"reset_mask": mask}, "the caller's own"
    assert np.array_equal(after[~mask], before[~mask])
    assert np.array_equal(after[0], after[3])
    assert not np.array_equal(after[0], before[0])
    ended = np.zeros(COUNT, bool)
    while not ended.any():
        ended = vector.step(np.array([1, 0, 1, 1]))[2]
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"of environments \[.*reset_mask"):
        vector.step(np.ones(COUNT, int))
    vector.reset(options={"reset_mask": ended})
    vector.step(np.ones(COUNT, int))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"num_envs": 0}, "num_envs must be a whole number, at least 1, not 0"),
        ({"backend": "ros-realtime"}, "has a single robot"),
        ({"render_mode": "human"}, "can't be shown on one page"),
        ({"autoreset_mode": "later"}, "'later' is not a valid AutoresetMode"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, text):
    with pytest.raises(ValueError, match=text):
        gymnasium.make_vec("cartpole/Balance-v0", **{"num_envs": 2, **options})


@pytest.mark.parametrize(
    ("actions", "text"),
    [
        (np.ones(3, int), "3 actions for 2 environments"),
        (np.array([0, np.nan]), "an action is 0 or 1"),
        (np.array([0, 7]), "an action is 0 or 1, not .*7"),
    ],
)
def test_a_wrong_action_moves_none_and_the_next_one_works(many, actions, text):
    plain, vector = many(), many()
    for each in (plain, vector):
        each.reset(seed=1)
    with pytest.raises(ValueError, match=text):
        vector.step(actions)
    seen = [each.step(np.array([1, 0]))[0] for each in (plain, vector)]
    assert np.array_equal(*seen)


def test_after_an_error_in_the_middle_all_are_reset(many, monkeypatch):
    vector = many()
    with pytest.raises(ValueError, match="length"):
        vector.reset(seed=[1, 2, 3])
    vector.reset(seed=1)
    task = vector.unwrapped.envs[1].task
    with monkeypatch.context() as patched:
        patched.setattr(task, "reward", lambda *_: "much")
        with pytest.raises(TaskError, match="reward"):
            vector.step(np.ones(2, int))
    mask = {"reset_mask": np.array([True, False])}
    for begin in (lambda: None, lambda: vector.reset(options=mask)):
        begin()
        with pytest.raises(gymnasium.error.ResetNeeded, match="an error interrupted the step"):
            vector.step(np.ones(2, int))
    again = vector.reset(seed=1)[0]
    assert np.array_equal(again, many().reset(seed=1)[0])
    vector.step(np.ones(2, int))


def test_where_one_cannot_be_made_the_others_are_closed():
    made = []

    def make(backend):
        if len(made) == 2:
            raise RobotEnvError("no third one")
        made.append(gymnasium.make("cartpole/Balance-v0", backend=backend).unwrapped)
        return made[-1]

    with pytest.raises(RobotEnvError, match="no third one"):
        RobotVectorEnv(3, make)
    for env in made:
        with pytest.raises(gymnasium.error.ClosedEnvironmentError):
            env.reset()


def test_all_go_on_from_a_snapshot_with_the_ends_of_their_episodes(many):
    vector = many(num_envs=COUNT, max_steps=5).unwrapped
    vector.reset(seed=1)
    actions = np.random.default_rng(2).integers(0, 2, (12, COUNT))
    for row in actions[:5]:
        vector.step(row)  # all episodes end
    snapshot = vector.save_state()
    first = [vector.step(row) for row in actions]
    vector.reset(seed=3)
    vector.step(actions[0])
    for _ in range(2):
        vector.restore_state(snapshot)
        again = [vector.step(row) for row in actions]
        assert all(same(a, b, exact=True) for a, b in zip(first, again, strict=True))
    other = many(num_envs=COUNT + 1).unwrapped
    with pytest.raises(ValueError, match=f"of {COUNT + 1} environments"):
        other.restore_state(snapshot)
    vector.restore_state(snapshot)
    broken = snapshot._replace(states=[*snapshot.states[1:], None])
    with pytest.raises(ValueError, match="isn't a snapshot"):
        vector.restore_state(broken)
    assert same(first[0], vector.step(actions[0]), exact=True)  # none is restored
    there = [each.state["state"].joints for each in snapshot.states]
    other.reset(options={"snapshot": snapshot.states[0]})
    assert [env.state.joints for env in other.envs] == [there[0]] * (COUNT + 1)
    other.reset(options={"snapshot": [*snapshot.states, snapshot.states[1]]})
    assert [env.state.joints for env in other.envs] == [*there, there[1]]
    with pytest.raises(ValueError, match=f"2 snapshots for {COUNT + 1} environments"):
        other.reset(options={"snapshot": snapshot.states[:2]})
    with pytest.raises(ValueError, match="a snapshot is what save_state"):
        other.reset(options={"snapshot": [*snapshot.states, "there"]})
    assert [env.state.joints for env in other.envs] == [*there, there[1]]  # none has begun
    other.reset(options={"snapshot": iter([snapshot.states[0]] * (COUNT + 1))})
    assert [env.state.joints for env in other.envs] == [there[0]] * (COUNT + 1)
