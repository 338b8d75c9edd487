"""Checks of goal environments: what hindsight experience replay relies on."""

from typing import Any

import numpy as np

from robot_envs.task import GoalTask
from robot_envs.testing.rollouts import outside, rollout
from robot_envs.testing.subject import Subject, expect, expect_error

CLOSE = 1e-9  # between a reward and the same one among others


def goals(subject: Subject) -> None:
    """Goals lie in their space; rewards are those of `compute_reward`, one by one and all at once."""
    with subject.made() as env:
        if not isinstance(env.task, GoalTask):
            expect(
                not hasattr(env, "compute_reward"),
                "it has compute_reward(), and its task is no GoalTask",
            )
            return
        given = [each for each in rollout(env, subject.steps, seed=5) if len(each) == 5]
        for seen, reward, _, _, info in given:
            for key in ("achieved_goal", "desired_goal"):
                wrong = outside(env.observation_space[key], seen[key])  # type: ignore[index]
                expect(not wrong, f"{key} isn't in the space of goals: {wrong}")
            alone = env.compute_reward(seen["achieved_goal"], seen["desired_goal"], info)
            expect(
                _near(alone, reward) or not env.measures_exactly,
                f"step() gave the reward {reward}, and compute_reward() of its goals gives {alone}",
            )
            expect(
                type(info.get("is_success")) is bool,
                f"an info has is_success={info.get('is_success')!r}, and no bool",
            )
        _check_all_at_once(env, given)
        _check_own_goal(env)


def _check_all_at_once(env: Any, given: list[Any]) -> None:
    achieved, desired = (
        np.stack([each[0][key] for each in given]) for key in ("achieved_goal", "desired_goal")
    )
    infos = np.array([each[4] for each in given], object)
    rewards = np.asarray(env.compute_reward(achieved, desired, infos))
    expect(
        rewards.shape == (len(given),),
        f"compute_reward() of {len(given)} goals at once gives the shape {rewards.shape}, and not "
        f"({len(given)},)",
    )
    for reward, one, other, info in zip(rewards, achieved, desired, infos, strict=True):
        alone = env.compute_reward(one, other, info)
        expect(
            _near(alone, reward),
            f"compute_reward({one}, {other}) alone gives {alone}, and among others {reward}",
        )
    reached = np.asarray(env.task.is_success(achieved, achieved))
    expect(
        reached.shape == (len(given),) and bool(reached.all()),
        f"is_success() of goals that were achieved as they were desired gives {reached}",
    )


def _check_own_goal(env: Any) -> None:
    """A goal that a user asks for is the episode's, unless it can't be."""
    wanted = env.task.goals().sample()
    seen, _ = env.reset(seed=6, options={"goal": wanted})
    expect(
        np.array_equal(seen["desired_goal"], wanted),
        f'reset(options={{"goal": {wanted}}}) has the desired goal {seen["desired_goal"]}',
    )
    wrong = np.full_like(wanted, np.nan)
    told = "reset() with a goal of NaN"
    expect_error(lambda: env.reset(options={"goal": wrong}), told, ValueError)


def _near(one: Any, other: Any) -> bool:
    return bool(np.abs(np.asarray(one, float) - float(other)) <= CLOSE * (1.0 + abs(float(other))))
