"""Options of a training: common ones, the algorithm's own, and their record in config.json."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from rl_workbench.env_ids import without_module
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.option import Options, check_options, is_plain, option, unknown
from rl_workbench.storage import CONFIG_RECORD, read_record, reading
from rl_workbench.training.algorithms import AlgorithmKind, algorithm

# A resumed training may change these.
EXTENDING = ("total_timesteps", "episodes", "stop_at_length", "stop_at_return", "device")
LARGEST_COUNT = 2**53
TREE = Path(__file__).resolve().parents[3]
SHARE = Path(__file__).resolve().parents[1] / "share"  # where it is installed (setup.py)


@dataclass(frozen=True)
class RunOptions:
    """The options that every training has. All frequencies count steps of the environment."""

    env_id: str = option("CartPole-v1", "Gymnasium's id of the environment")
    env_kwargs: dict[str, Any] = option({}, "options of the environment, KEY=VALUE with commas")
    train_env_kwargs: dict[str, Any] = option({}, "further options, for training")
    eval_env_kwargs: dict[str, Any] = option({}, "further options, for evaluations")
    wrapper: str = option(
        "", "function that wraps each environment, as module:function", metavar="MODULE:FUNCTION"
    )
    seed: int = option(0, "seed of weights, exploration, environment and evaluation", 0, 2**31 - 1)
    num_envs: int = option(1, "number of environments to learn in at the same time", 1, 1024)
    total_timesteps: int = option(0, "length of the training [steps]; 0: no limit", 0, LARGEST_COUNT)
    episodes: int = option(0, "length in episodes, if that comes first; 0: no limit", 0, LARGEST_COUNT)
    stop_at_return: float | None = option(
        None, "end the training when a confirmed mean return reaches X", -1e18, 1e18, metavar="X"
    )
    stop_at_length: float = option(
        0.0, "end the training when the last 20 episodes lasted X steps on average; 0: never", 0, 1e9,
        metavar="X",
    )  # fmt: skip
    device: str = option("cpu", "torch device, e.g. cpu or cuda")
    exp_name: str = option("", "part of the run folder's name; the algorithm's name by default")
    run_dir: str = option("", "a new or empty folder for all results (runs/ENV__EXP__SEED__TIME)")
    eval_frequency: int = option(10_000, "steps between evaluations; 0: only at the end", 0, LARGEST_COUNT)
    eval_episodes: int = option(10, "greedy episodes per evaluation", 1, 10**6)
    confirm_episodes: int = option(
        0, "greedy episodes that confirm a new best policy; 0: as many as in an evaluation", 0, 10**6
    )
    checkpoint_frequency: int = option(
        10_000, "steps between checkpoints; 0: only at start and end", 0, LARGEST_COUNT
    )
    keep_checkpoints: int = option(3, "how many of the newest checkpoints to keep; 0: all", 0, 10**6)
    log_frequency: int = option(500, "steps between logged points of losses/", 1, LARGEST_COUNT)

    def __post_init__(self) -> None:
        check_options(self)
        if not self.env_id:
            raise WorkbenchError("env_id must name an environment")
        if not self.total_timesteps and not self.episodes:
            raise WorkbenchError("a training needs an end: total_timesteps, episodes, or both")
        for name in ("env_kwargs", "train_env_kwargs", "eval_env_kwargs"):
            if not is_plain(getattr(self, name)):
                raise WorkbenchError(
                    f"{name} has values that JSON can't hold: {getattr(self, name)}; use texts, "
                    "finite numbers, true, false, and lists and mappings of these"
                )

    @property
    def training_environment(self) -> dict[str, Any]:
        """The options of the environment to learn in."""
        return self.env_kwargs | self.train_env_kwargs

    @property
    def evaluation_environment(self) -> dict[str, Any]:
        """The options of the environment for evaluations."""
        return self.training_environment | self.eval_env_kwargs


@dataclass(frozen=True)
class SessionOptions:
    """Options of one session. They aren't recorded, so they may differ when the training is resumed."""

    gui: bool = option(False, "show a page in the browser: episodes of the newest checkpoint")
    callback: str = option(
        "", "callbacks of your own as module:Class, several with commas", metavar="MODULE:CLASS"
    )


class TrainingOptions(NamedTuple):
    """All options of a new training, or of one to resume."""

    kind: AlgorithmKind
    run: RunOptions
    hyperparameters: Any  # an instance of the kind's dataclass
    resume: Path | None = None
    session: SessionOptions = SessionOptions()

    def record(self) -> dict[str, Any]:
        """Returns the recorded settings as plain values, for config.json and checkpoints."""
        run, own = asdict(self.run), asdict(self.hyperparameters)
        # Where both have an option, as the length that a schedule depends on, the run's counts.
        hyperparameters = {name: value for name, value in own.items() if name not in run}
        return {"algorithm": self.kind.name, "run": run, "hyperparameters": hyperparameters}

    def doubt(self) -> str:
        """Returns a line if the training ends before learning starts; else ""."""
        steps = self.run.total_timesteps
        starts = getattr(self.hyperparameters, "learning_starts", 0)
        if steps and starts >= steps:
            return (
                f"learning starts after {starts} steps (learning_starts), but the training ends after "
                f"{steps} (total_timesteps): it learns next to nothing"
            )
        return ""

    def check_same(self, content: Any, origin: str) -> None:
        """Refuses a checkpoint's options that differ where a resumed training can't change them."""
        before, now = _flat(content, origin), _flat(self.record(), origin)
        for name, value in before.items():
            if name not in EXTENDING and now.get(name) != value:
                raise WorkbenchError(
                    f"{origin}: {CONFIG_RECORD} says {name} {now.get(name)}, the checkpoint {value}; "
                    "a resumed training keeps its settings"
                )


def known_options(kind: AlgorithmKind) -> Options:
    """Returns all recorded options of an algorithm's trainings."""
    if kind.package:
        need(*kind.package, f"the algorithm {kind.name}")
    return Options(RunOptions, kind.hyperparameters())


def make_options(
    kind: AlgorithmKind, values: Mapping[str, Any], resume: Path | None = None
) -> TrainingOptions:
    """Makes options of converted values. What is missing gets its default."""
    options = known_options(kind)
    merged = until_the_steps({"exp_name": kind.name, **kind.defaults}, values)
    run = options.make(RunOptions, merged)
    if run.num_envs > 1 and not kind.learns_in_several:
        raise WorkbenchError(f"{kind.name} learns in one environment: num_envs must be 1, not {run.num_envs}")
    return TrainingOptions(kind, run, options.make(kind.hyperparameters(), merged), resume)


def until_the_steps(values: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Merges values. Steps that are given without episodes replace a default number of episodes."""
    counted = {"episodes": 0} if given.get("total_timesteps") else {}
    return {**values, **counted, **given}


def recorded_options(content: Any, origin: str) -> TrainingOptions:
    """Returns the options that `TrainingOptions.record` wrote."""
    values = _flat(content, origin)
    kind = algorithm(str(values.pop("algorithm")))
    return make_options(kind, known_options(kind).read(values, origin))


def recorded_kind(folder: Path) -> AlgorithmKind:
    """Returns the algorithm of the training in a run folder."""
    return recorded_options(read_record(folder), str(folder / CONFIG_RECORD)).kind


def resumed_options(kind: AlgorithmKind, folder: Path, given: Mapping[str, Any]) -> TrainingOptions:
    """Returns the options of the training in a run folder, with a new length."""
    origin = str(folder / CONFIG_RECORD)
    old = recorded_options(read_record(folder), origin)
    if old.kind != kind:
        raise WorkbenchError(f"{origin} is of a training by {old.kind.name}, not by {kind.name}")
    values = asdict(old.run) | asdict(old.hyperparameters)
    return make_options(kind, until_the_steps(values, given), folder)


def _flat(record: Any, origin: str) -> dict[str, Any]:
    """Returns all settings of a record by name, as JSON has them: without tuples."""
    found = record if isinstance(record, dict) else {}
    parts = [found.get(name) for name in ("hyperparameters", "run")]
    if not isinstance(found.get("algorithm"), str) or not all(isinstance(p, dict) for p in parts):
        raise WorkbenchError(f"{origin} isn't the record of a training")
    try:
        plain = json.loads(json.dumps(record))
    except (TypeError, ValueError, RecursionError) as error:  # of a foreign checkpoint
        raise WorkbenchError(f"{origin} isn't the record of a training: {error}") from error
    return {"algorithm": plain["algorithm"], **plain["hyperparameters"], **plain["run"]}


def default_file(name: str) -> Path:
    """Finds the project's own config/NAME: in the source tree, or next to the installed modules."""
    for folder in (TREE, SHARE):
        path = folder / "config" / name
        if path.is_file():
            return path
    raise WorkbenchError(f"config/{name} is neither in {TREE} nor in an installed package")


def section_names(form: str, env_id: str | None) -> tuple[str, ...]:
    """Returns the possible names of an environment's section, with and without the id's module."""
    ids = (env_id, without_module(env_id)) if env_id else ()
    return tuple(dict.fromkeys(form.format(env_id=each) for each in ids))


def read_section(path: Path, names: Sequence[str], preset: str | None) -> dict[str, Any]:
    """Reads the options of a preset, or of the first section that exists; a file without sections is one."""
    with reading(path, "isn't YAML: {}", (yaml.YAMLError, UnicodeDecodeError)):
        content = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    if not isinstance(content, dict):
        raise WorkbenchError(f"{path} isn't a YAML file of options")
    if content and not any(isinstance(value, dict) for value in content.values()):
        if preset:
            raise WorkbenchError(f"{path} has no sections, so no preset {preset!r} either")
        return content
    if preset and preset not in content:
        raise WorkbenchError(f"{path}: {unknown('preset', preset, list(content))}")
    name = preset or next((each for each in names if each in content), "")
    section = content.get(name) or {}
    if not isinstance(section, dict):
        raise WorkbenchError(f"{path}: {name} isn't a section of options")
    return section
