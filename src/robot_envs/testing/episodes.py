"""Checks of single episodes: results, resets, ends, refusals, pictures and goals."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import gymnasium
import numpy as np

from robot_envs.backends import make_backend
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.task import GoalTask
from robot_envs.testing.rollouts import Subject, differences, expect_error, numbers, outside, rollout, same
from robot_envs.world_state import InitialState, LinkQuery, StateQuery, WorldState
from robot_sim.physics.pose import conjugate, rotate

LOWER = 0.8  # of the height at which a robot starts: it hasn't sunk
UPRIGHT = 0.9  # cosine of the largest tilt
TRIES = 20  # episodes, to find one that doesn't end by itself


def check_stands(robot: Robot, joints: Mapping[str, float], seconds: float = 5.0) -> None:
    """Checks that a robot with a free base stands while its controllers hold where its joints start.

    It is spawned on the ground, with `joints` at these positions [rad, m], others at 0. Raises AssertionError
    if it sinks or tilts within that simulated time [s].
    """
    root, time, fallen = robot.links.root, 0.0, ""
    backend = make_backend(Scene([robot]), None, robot.control_period)
    try:
        backend.look(StateQuery(links=(LinkQuery(root),)))
        state = backend.reset(InitialState(joints=joints))
        start = state.links[root].pose
        up = rotate(conjugate(start.orientation), (0.0, 0.0, 1.0))
        while time < seconds - robot.control_period / 2.0:
            state = backend.act({})
            time += robot.control_period
            end = state.links[root].pose
            level = rotate(end.orientation, up)[2]
            stands = end.position[2] > LOWER * start.position[2] and level > UPRIGHT
            fallen = fallen or ("" if stands else _yielding(robot, joints, state, time))
    finally:
        backend.close()
    assert stands, (
        f"it doesn't stand: after {seconds:g} s '{root}' is at a height of {end.position[2]:.3f} m, having "
        f"begun at {start.position[2]:.3f} m, and tilted by "
        f"{math.degrees(math.acos(max(-1.0, min(1.0, level)))):.0f} degrees{fallen}"
    )


def _yielding(robot: Robot, joints: Mapping[str, float], state: WorldState, time: float) -> str:
    """Returns which joint is farthest from where it starts, and what holds it."""
    off = {name: abs(each.position - joints.get(name, 0.0)) for name, each in state.joints.items()}
    name = max(off, key=lambda each: off[each])
    effort, most = abs(state.joints[name].effort), robot.limits[name].effort
    of, mend = "", "a higher p would hold it"
    if most is not None and effort >= 0.99 * most:
        of, mend = f" of {most:g}", "a higher limit of effort would hold it"
    return (
        f"; it fell after {time:.2g} s, '{name}' being {off[name]:.2g} rad or m from its start with an "
        f"effort of {effort:.3g}{of}: {mend}, or a posture that strains it less"
    )


def observations(subject: Subject) -> None:
    """Observations are finite and lie in their space; reward and flags are plain Python."""
    with subject.made() as env:
        for at, given in enumerate(rollout(env, subject.steps, seed=1)):
            seen = given[0]
            wrong = outside(env.observation_space, seen)
            assert not wrong, f"observation {at} of a rollout isn't in the observation space: {wrong}"
            for array in numbers(seen):
                finite = array.dtype.kind != "f" or np.isfinite(array).all()
                assert finite, f"observation {at} of a rollout isn't finite: {seen!r}"
            assert type(given[-1]) is dict, f"an info is {given[-1]!r}, and no dict"
            if len(given) == 5:
                kinds = [type(each) for each in given[1:4]]
                names = ", ".join(kind.__name__ for kind in kinds)
                assert kinds == [float, bool, bool], (
                    f"reward, terminated and truncated are {names}, and not float, bool, bool"
                )


def observations_are_new(subject: Subject) -> None:
    """An observation doesn't change with later steps."""
    with subject.made() as env:
        env.action_space.seed(2)
        first, _ = env.reset(seed=2)
        kept = [array.copy() for array in numbers(first)]
        env.step(env.action_space.sample())
        assert same(kept, list(numbers(first))), (
            "an observation has changed with the next step; observe() must make a new array each time"
        )


def ends(subject: Subject) -> None:
    """An episode is truncated after `max_steps`, and not terminated by that; no step follows an end."""
    with subject.made(max_steps=1) as env:
        action = env.action_space.sample()
        cut = False
        for seed in range(TRIES):
            env.reset(seed=seed)
            _, _, terminated, truncated, _ = env.step(action)
            assert terminated or truncated, "an episode with max_steps=1 continues after its first step"
            assert not (terminated and truncated), "an episode is terminated and truncated at once"
            cut = cut or truncated
            behind = "step() behind an episode's end"
            expect_error(lambda: env.step(action), behind, gymnasium.error.ResetNeeded)
        assert cut, f"{TRIES} episodes of random seeds all terminate with their first step"


def beginnings(subject: Subject) -> None:
    """No step precedes the first reset; a reset's options work."""
    with subject.made() as env:
        action = env.action_space.sample()
        first = "step() before the first reset()"
        expect_error(lambda: env.step(action), first, gymnasium.error.ResetNeeded)
        unknown = {"no_such_option": 1}
        expect_error(
            lambda: env.reset(options=unknown), "reset() with an option that doesn't exist", ValueError
        )
        begin = {"initial_state": InitialState()}
        states = []
        for seed in (0, 0):
            env.reset(seed=seed, options=begin)
            states.append(env.state.joints if env.state else {})
        assert states[0] == states[1], (
            f"reset() to the same initial_state gives joints {states[0]} and {states[1]}"
        )


def wrong_actions(subject: Subject) -> None:
    """An action outside the space is refused, and moves nothing."""
    with subject.made() as env:
        env.action_space.seed(3)
        actions = [env.action_space.sample() for _ in range(4)]
        undisturbed = _given(env, actions, [])
        disturbed = _given(env, actions, _wrong(env.action_space))
        if env.backend.deterministic:
            difference = differences(undisturbed, disturbed)
            assert not difference, f"a refused action has moved something: {difference}"


def _given(env: Any, actions: list[Any], wrong: list[Any]) -> list[tuple[Any, ...]]:
    given = [env.reset(seed=3)]
    for action in actions:
        if given[-1][2:4] not in ((), (False, False)):
            break
        for each in wrong:
            expect_error(partial(env.step, each), f"step() with the action {each!r}", ValueError)
        given.append(env.step(action))
    return given


def _wrong(space: gymnasium.Space[Any]) -> list[Any]:
    wrong: list[Any] = [None, "1", float("nan")]
    if isinstance(space, gymnasium.spaces.Discrete):
        return [*wrong, int(space.start) - 1, int(space.start + space.n), np.zeros(2)]
    if isinstance(space, gymnasium.spaces.Box):
        wrong += [np.zeros((*space.shape, 2)), np.full(space.shape, np.nan, space.dtype)]
        above = np.asarray(space.high, np.float64) + 1.0
        wrong += [above] if np.isfinite(above).all() else []
    return wrong


def closed(subject: Subject) -> None:
    """A closed environment says so, and may be closed again."""
    with subject.made() as env:
        env.reset(seed=1)
        action = env.action_space.sample()
        env.close()
        env.close()
        for name, call in (("reset", env.reset), ("step", lambda: env.step(action))):
            expect_error(call, f"{name}() behind close()", gymnasium.error.ClosedEnvironmentError)


def wrong_options(subject: Subject) -> None:
    """An unknown option, and a control period of fractional physics steps, are refused."""
    for options in ({"no_such_option": 1}, {"control_period": 0.00123}):

        def make(options: dict[str, Any] = options) -> None:
            with subject.made(**options):
                pass

        kinds = (ValueError, TypeError, gymnasium.error.Error)
        expect_error(make, f"making it with the options {options}", *kinds)


def pictures(subject: Subject) -> None:
    """Pictures have the requested size, and change as the robot moves."""
    with subject.made(render_mode="rgb_array", width=96, height=64) as env:
        env.action_space.seed(4)
        env.reset(seed=4)
        first = env.render()
        assert isinstance(first, np.ndarray) and first.shape == (64, 96, 3) and first.dtype == np.uint8, (
            "render() with width 96 and height 64 gives no array of uint8 of the shape (64, 96, 3)"
        )
        for _ in range(subject.steps):
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                env.reset()
            if not same(env.render(), first):
                return
        raise AssertionError(f"pictures of {subject.steps} steps are all the same")


CLOSE = 1e-9  # relative difference between a reward alone and in a batch


def goals(subject: Subject) -> None:
    """Goals are in their space; rewards are those of `compute_reward`, one by one and all at once."""
    with subject.made() as env:
        if not isinstance(env.task, GoalTask):
            assert not hasattr(env, "compute_reward"), (
                "it has compute_reward(), and its task is not a GoalTask"
            )
            return
        given = [each for each in rollout(env, subject.steps, seed=5) if len(each) == 5]
        for seen, reward, _, _, info in given:
            for key in ("achieved_goal", "desired_goal"):
                wrong = outside(env.observation_space[key], seen[key])  # type: ignore[index]
                assert not wrong, f"{key} isn't in the space of goals: {wrong}"
            alone = env.compute_reward(seen["achieved_goal"], seen["desired_goal"], info)
            assert _near(alone, reward) or not env.measures_exactly, (
                f"step() gave the reward {reward}, and compute_reward() of its goals gives {alone}"
            )
            assert type(info.get("is_success")) is bool, (
                f"an info has is_success={info.get('is_success')!r}, and no bool"
            )
        _check_all_at_once(env, given)
        _check_own_goal(env)


def _check_all_at_once(env: Any, given: list[Any]) -> None:
    achieved, desired = (
        np.stack([each[0][key] for each in given]) for key in ("achieved_goal", "desired_goal")
    )
    infos = np.array([each[4] for each in given], object)
    rewards = np.asarray(env.compute_reward(achieved, desired, infos))
    assert rewards.shape == (len(given),), (
        f"compute_reward() of {len(given)} goals at once gives the shape {rewards.shape}, and not "
        f"({len(given)},)"
    )
    for reward, one, other, info in zip(rewards, achieved, desired, infos, strict=True):
        alone = env.compute_reward(one, other, info)
        assert _near(alone, reward), (
            f"compute_reward({one}, {other}) alone gives {alone}, and among others {reward}"
        )
    reached = np.asarray(env.task.is_success(achieved, achieved))
    assert reached.shape == (len(given),) and bool(reached.all()), (
        f"is_success() of goals that were achieved as they were desired gives {reached}"
    )


def _check_own_goal(env: Any) -> None:
    """A requested goal is the episode's, unless it is impossible."""
    wanted = env.task.goals().sample()
    seen, _ = env.reset(seed=6, options={"goal": wanted})
    assert np.array_equal(seen["desired_goal"], wanted), (
        f'reset(options={{"goal": {wanted}}}) has the desired goal {seen["desired_goal"]}'
    )
    wrong = np.full_like(wanted, np.nan)
    expect_error(lambda: env.reset(options={"goal": wrong}), "reset() with a goal of NaN", ValueError)


def _near(one: Any, other: Any) -> bool:
    return bool(np.abs(np.asarray(one, float) - float(other)) <= CLOSE * (1.0 + abs(float(other))))
