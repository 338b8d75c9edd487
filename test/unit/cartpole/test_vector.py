"""Vector environments: each world as if it were alone, whatever runs it; and what can go wrong."""

import os
import signal
import socket
import threading
import time

import gymnasium
import numpy as np
import pytest
from environment_conformance import IDS, RICH
from gymnasium.utils.env_checker import data_equivalence as same
from gymnasium.vector import AutoresetMode

import cartpole  # noqa: F401 - registers the environments
from robot_envs.errors import SimulatorError
from robot_envs.vector import process

COUNT = 5
OPTIONS = {"max_steps": 40, **RICH}
OURS = [{"workers": 0}, {"workers": 1}, {"workers": 2}]


def gone(pid):
    """Whether a process has ended and was waited for."""
    return not os.path.exists(f"/proc/{pid}")


def vector_rollout(env, steps=200):
    env.action_space.seed(5)
    given = [env.reset(seed=9)]
    given += [env.step(env.action_space.sample()) for _ in range(steps)]
    env.close()
    return given


ALL = [(identifier, mode) for identifier in IDS for mode in ("NextStep", "SameStep")]
SOME = (ALL[0], ALL[-1])  # in every run: another task, and another mode


@pytest.mark.parametrize(
    ("identifier", "mode"),
    [pytest.param(*each, marks=() if each in SOME else pytest.mark.long) for each in ALL],
)
def test_all_ways_give_the_same_bits(identifier, mode):
    of_gymnasium = [
        gymnasium.make_vec(identifier, COUNT, kind, {"autoreset_mode": mode}, **OPTIONS)
        for kind in ("sync", "async")
    ]
    of_ours = [
        gymnasium.make_vec(identifier, COUNT, autoreset_mode=mode, **ours, **OPTIONS)
        for ours in OURS
    ]
    first, *others = [vector_rollout(env) for env in of_gymnasium + of_ours]
    for other in others:
        assert all(same(a, b, exact=True) for a, b in zip(first, other, strict=True))


@pytest.mark.parametrize("ours", OURS)
def test_each_world_goes_as_if_it_were_alone(ours):
    vector = gymnasium.make_vec("cartpole/Classic-v0", COUNT, **ours)
    together = [vector.reset(seed=30)[0]]
    actions = np.arange(30)[:, np.newaxis] // [1, 2, 1, 2, 1] % 2
    together += [vector.step(row)[0] for row in actions]
    vector.close()
    for index in range(COUNT):
        env = gymnasium.make("cartpole/Classic-v0")
        alone = [env.reset(seed=30 + index)[0], *(env.step(row[index])[0] for row in actions)]
        env.close()
        assert np.array_equal(alone, [row[index] for row in together])


@pytest.mark.parametrize("ours", OURS)
def test_only_the_masked_worlds_are_reset(ours):
    vector = gymnasium.make_vec("cartpole/Classic-v0", COUNT, autoreset_mode="Disabled", **ours)
    vector.reset(seed=1)
    before = vector.step(np.ones(COUNT, int))[0]
    mask = np.array([True, False, False, True, False])
    after, _ = vector.reset(seed=[7] * COUNT, options={"reset_mask": mask})
    assert np.array_equal(after[~mask], before[~mask])
    assert np.array_equal(after[0], after[3])
    assert not np.array_equal(after[0], before[0])
    for wrong in (np.zeros(COUNT, bool), np.ones(2, bool), [True] * COUNT):
        with pytest.raises(ValueError, match="reset_mask"):
            vector.reset(options={"reset_mask": wrong})
    vector.close()


@pytest.mark.parametrize("ours", OURS)
def test_a_reset_right_after_an_end_is_the_only_one(ours):
    vector = gymnasium.make_vec("cartpole/Classic-v0", 2, max_steps=1, **ours)
    for _ in range(2):
        vector.reset(seed=1)
        _, rewards, _, truncations, _ = vector.step(np.ones(2, int))
        assert rewards.tolist() == [1.0, 1.0]  # a step that starts an episode has none
        assert truncations.all()
    vector.close()


@pytest.mark.parametrize("ours", OURS)
def test_pictures_and_attributes_of_all(ours):
    vector = gymnasium.make_vec("cartpole/SwingUp-v0", 3, render_mode="rgb_array", **ours)
    vector.reset(seed=1)
    assert [picture.shape for picture in vector.render()] == [(320, 640, 3)] * 3
    assert vector.get_attr("render_mode") == ("rgb_array",) * 3
    vector.close()


def test_it_says_how_it_resets_and_what_its_spaces_are():
    vector = gymnasium.make_vec("cartpole/Balance-v0", 2, workers=0)
    assert vector.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert vector.action_space.shape == (2,)
    assert vector.observation_space.shape == (2, 4)
    vector.close()


@pytest.mark.parametrize("ours", OURS)
def test_results_are_the_callers_own(ours):
    vector = gymnasium.make_vec("cartpole/Classic-v0", 2, **ours)
    kept = vector.reset(seed=1)[0]
    copy = kept.copy()
    vector.step(np.ones(2, int))
    assert np.array_equal(kept, copy)
    vector.close()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"num_envs": 0}, "num_envs must be at least 1"),
        ({"workers": -1}, r"workers must lie in \[0, 4\]"),
        ({"workers": 5}, r"workers must lie in \[0, 4\]"),
        ({"backend": "ros"}, "has a single robot"),
        ({"render_mode": "human"}, "no window"),
        ({"noise": 3.0}, "noise must lie"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, text):
    with pytest.raises(ValueError, match=text):
        gymnasium.make_vec("cartpole/Balance-v0", **{"num_envs": 4, **options})


@pytest.mark.parametrize("ours", OURS)
def test_a_bad_call_is_refused_and_the_next_one_works(ours):
    vector = gymnasium.make_vec("cartpole/Balance-v0", 4, **ours)
    with pytest.raises(ValueError, match="3 seeds for 4"):
        vector.reset(seed=[1, 2, 3])
    vector.reset(seed=1)
    with pytest.raises(ValueError, match="shape"):
        vector.step(np.ones(3, int))
    for fractions in ([0, 1, 0, 0.7], [0, 1, 0, float("nan")]):
        with pytest.raises(ValueError, match="an action isn't of Discrete"):
            vector.step(np.array(fractions))
    with pytest.raises(ValueError, match="an action is 0 or 1, not 7"):
        vector.step(np.array([0, 1, 0, 7]))
    vector.reset(seed=1)
    assert vector.step(np.ones(4, int))[0].shape == (4, 4)
    vector.close()


def test_a_worker_that_dies_is_an_error_that_names_it_and_its_worlds():
    vector = gymnasium.make_vec("cartpole/Balance-v0", 4, workers=2)
    vector.reset(seed=0)
    pids = vector.workers
    os.kill(pids[1], signal.SIGKILL)
    with pytest.raises(
        SimulatorError, match=f"{pids[1]} with environments 2 to 3 was killed by SIGKILL"
    ):
        for _ in range(2):  # the kill may come after the answer
            vector.step(np.ones(4, int))
    vector.close()
    assert all(map(gone, pids))


def test_a_worker_that_hangs_is_an_error(monkeypatch):
    monkeypatch.setattr(process, "END_TIMEOUT", 0.2)
    vector = gymnasium.make_vec("cartpole/Balance-v0", 4, workers=2)
    os.kill(vector.workers[0], signal.SIGSTOP)
    vector._workers[0].limit(0.2)
    try:
        with pytest.raises(SimulatorError, match=r"gave no answer within 0.2 s, and was ended"):
            vector.reset(seed=0)
        with pytest.raises(
            SimulatorError, match="was killed by SIGKILL"
        ):  # no late answer is taken
            vector.reset(seed=0)
    finally:
        vector.close()


def test_a_default_timeout_of_sockets_as_rospys_does_no_harm():
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(5.0)
    try:
        vector = gymnasium.make_vec("cartpole/Balance-v0", 4, workers=2)
        vector.reset(seed=0)
        vector.close()
    finally:
        socket.setdefaulttimeout(before)


def test_closing_ends_all_workers_and_may_be_done_twice():
    vector = gymnasium.make_vec("cartpole/Balance-v0", 4, workers=2)
    pids = vector.workers
    vector.close()
    vector.close()
    assert all(map(gone, pids))


def test_an_interrupted_call_leaves_nothing_that_the_next_one_could_mistake(monkeypatch):
    vector = gymnasium.make_vec("cartpole/Balance-v0", 4, workers=2)
    vector.reset(seed=0)
    pids = vector.workers

    def interrupt():
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(vector.unwrapped._workers[1], "answer", interrupt)
        with pytest.raises(KeyboardInterrupt):
            vector.step(np.ones(4, int))
    for call in (vector.reset, lambda: vector.step(np.ones(4, int))):
        with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="make another one"):
            call()
    assert all(map(gone, pids))


@pytest.mark.parametrize("ours", OURS)
def test_a_closed_one_says_so(ours):
    vector = gymnasium.make_vec("cartpole/Balance-v0", 2, **ours)
    vector.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="make another one"):
        vector.reset()


def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    path = tmp_path / "pids"
    parent = os.fork()
    if parent == 0:
        try:
            vector = gymnasium.make_vec("cartpole/Balance-v0", 4, workers=2)
            path.write_text(" ".join(map(str, vector.workers)))
        finally:
            os.kill(os.getpid(), signal.SIGKILL)  # and never back into pytest
    os.waitpid(parent, 0)
    pids = [int(pid) for pid in path.read_text().split()]
    deadline = time.monotonic() + 60.0
    while not all(map(gone, pids)) and time.monotonic() < deadline:
        threading.Event().wait(0.05)
    assert len(pids) == 2
    assert all(map(gone, pids))
