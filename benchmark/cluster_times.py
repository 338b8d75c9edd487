"""Measured times of a local cluster of Ray's, for scaling.py: of workers that play, and of jobs."""

import contextlib
import io
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rl_workbench.agents.pg.reinforce import ReinforceAgent
from rl_workbench.tools.jobs.job import Job
from rl_workbench.tools.jobs.machines import Machines
from rl_workbench.tools.jobs.runner import Runner
from rl_workbench.tools.runs.runs import open_run, training_curve
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.cluster.nodes import Cluster
from rl_workbench.training.options.training_options import TrainingOptions, choose
from rl_workbench.training.pg.algorithm import make_agent
from rl_workbench.training.pg.remote import EpisodePlayer, Played
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.algorithm import environments_elsewhere
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.training import Training

EPISODES = 12  # that the times of a step are taken from
ROUNDS = 12  # of a training that is measured
CALLS = 300
JOB = ("--algo", "dqn", "--preset=tutorial", "--params", "env_id=CartPole-v1", "total_timesteps=3000",
       "eval_frequency=0", "eval_episodes=1")  # fmt: skip


class Sample(NamedTuple):
    """Episodes of a policy that hasn't learned."""

    played: list[Played]
    lengths: list[int]
    seconds: list[float]  # each


def options(env_id: str, backend: str, workers: int = 1, rounds: int = ROUNDS) -> TrainingOptions:
    """A training that hardly changes its policy, so that its episodes stay alike."""
    pairs = {"env_id": env_id, "env_kwargs": f"backend={backend}", "num_envs": workers,
             "episodes": rounds * workers, "policy_learning_rate": 1e-9, "stop_at_length": 0,
             "eval_frequency": 0, "eval_episodes": 1, "seed": 0}  # fmt: skip
    return choose(
        algorithm("reinforce"), ["--params", *(f"{name}={value}" for name, value in pairs.items())]
    )


def policy_of(chosen: TrainingOptions) -> Any:
    here, _ = environments_elsewhere(chosen)
    agent = make_agent(chosen, here)
    assert isinstance(agent, ReinforceAgent)
    return agent.policy_state()


def sample(chosen: TrainingOptions) -> Sample:
    player = EpisodePlayer(chosen, 0)
    policy = policy_of(chosen)
    # Over ROS a step is another process's work, which only the wall's clock sees.
    is_inside = not chosen.run.env_kwargs["backend"].startswith("ros")
    clock = time.process_time if is_inside else time.perf_counter
    found, place = Sample([], [], []), player.play(None, None).place
    for _ in range(EPISODES):
        began = clock()
        played = player.play(policy, place)
        found.seconds.append(clock() - began)
        assert played.episode is not None
        found.lengths.append(len(played.episode["rewards"]))
        found.played.append(played)
        place = played.place
    player.close()
    return found


def line(lengths: Sequence[int], seconds: Sequence[float]) -> tuple[float, float]:
    """Seconds of a step and of an episode beside its steps."""
    if len(set(lengths)) == 1:
        return statistics.median(seconds) / lengths[0], 0.0
    slope, rest = np.polyfit(lengths, seconds, 1)
    return float(slope), max(float(rest), 0.0)


class Echo:
    """An actor that has played already."""

    def __init__(self, answer: Any) -> None:
        self._answer = answer

    def play(self, policy: Any, state: Any) -> Any:
        return self._answer


def calls(cluster: Cluster, found: Sample, policy: Any) -> tuple[float, float]:
    """Seconds of the driver for a call that carries an episode, and those that it waits beside."""
    ray = cluster.ray
    actor = ray.remote(Echo).options(num_cpus=0).remote(found.played[0])
    shared, place = ray.put(policy), found.played[0].place
    ray.get(actor.play.remote(shared, place))
    waits, began = [], time.process_time()
    for _ in range(CALLS):
        at = time.perf_counter()
        ray.get(actor.play.remote(shared, place))
        waits.append(time.perf_counter() - at)
    own = (time.process_time() - began) / CALLS
    ray.kill(actor)
    return own, max(statistics.median(waits) - own, 0.0)


class Rollouts(NamedTuple):
    """What a training whose workers play comes to."""

    rate: float  # steps [1/s], from the end of the first round on
    start: float  # seconds until the workers could play
    learn_step: float  # processor seconds of the driver between two rounds, for each step


def real_rollouts(cluster: Cluster, chosen: TrainingOptions) -> Rollouts:
    from rl_workbench.training.rollouts.workers import Workers  # Ray, which `joined` imports first

    starts: list[float] = []
    marks: list[float] = []  # [s of the processor]: begin and end of each round

    class Timed(Workers):
        """Workers, and when they are asked."""

        def play(
            self, policy: Any, states: Sequence[Any], should_stop: Callable[[], bool]
        ) -> list[Any] | None:
            marks.append(time.process_time())
            found = super().play(policy, states, should_stop)
            marks.append(time.process_time())
            return found

    def make_pool(theirs: TrainingOptions) -> Workers:
        began = time.perf_counter()
        pool = Timed(cluster, theirs, print)
        starts.append(time.perf_counter() - began)
        return pool

    with tempfile.TemporaryDirectory() as folder:
        training = Training(chosen._replace(make_pool=make_pool), Path(folder), Interrupt())
        with contextlib.redirect_stdout(io.StringIO()):
            training.run()
        curve = training_curve(open_run(Path(folder)))
    count = chosen.run.num_envs
    ends, steps = curve.times[count - 1 :: count], curve.steps[count - 1 :: count]
    # The first two marks are the seeding's, and nothing is learned before the first round's end.
    between = np.subtract(marks[4::2], marks[3:-1:2])
    return Rollouts(
        float((steps[-1] - steps[0]) / (ends[-1] - ends[0])),
        starts[0],
        float(between.sum() / steps[-2]),
    )


def run_jobs(machines: Callable[[Path], Machines], count: int) -> tuple[float, float]:
    """Seconds that jobs took, and processor seconds of this process for each."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        wanted = [
            Job(f"job {seed}", folder / f"seed_{seed}", (f"--seed={seed}", *JOB))
            for seed in range(count)
        ]
        began, own = time.perf_counter(), time.process_time()
        with run_folder.held(folder):  # nodes look whether they are told of the lock
            Runner(machines(folder)).run(wanted, Interrupt())
        seconds = time.perf_counter() - began
        own = time.process_time() - own
        assert all(job.is_done() for job in wanted), wanted[0].log.read_text()
    return seconds, own / count
