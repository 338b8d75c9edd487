"""What one training is to do: common options and the algorithm's own, chosen, recorded, compared."""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.command_line import CommandLine, flag
from rl_workbench.training.options.config_file import default_file, read_section, section_names
from rl_workbench.training.options.kind import AlgorithmKind
from rl_workbench.training.options.options import Options
from rl_workbench.training.options.record import CONFIG_RECORD, read_record
from rl_workbench.training.options.run_options import RunOptions
from rl_workbench.training.options.session import SessionOptions

# May be changed when resuming.
EXTENDING = ("total_timesteps", "episodes", "stop_at_length", "stop_at_return", "device")
RECORDED_AS = {"n_envs": "num_envs"}  # of trainings of earlier versions, which can be gone on with


class TrainingOptions(NamedTuple):
    """A new training by these options, or an old one to go on with."""

    kind: AlgorithmKind
    run: RunOptions
    hyperparameters: Any  # an instance of the kind's dataclass
    resume: Path | None = None
    session: SessionOptions = SessionOptions()

    def record(self) -> dict[str, Any]:
        """All settings as plain values, for config.json and checkpoints."""
        run, own = asdict(self.run), asdict(self.hyperparameters)
        # What both have, as a length that a schedule depends on, is the run's.
        hyperparameters = {name: value for name, value in own.items() if name not in run}
        return {"algorithm": self.kind.name, "run": run, "hyperparameters": hyperparameters}

    def check_same(self, content: Any, origin: str) -> None:
        """Holds these options against those in a checkpoint.

        Raises:
            WorkbenchError: if one differs that a resumed training can't change.
        """
        before, now = _flat(content, origin), _flat(self.record(), origin)
        for name, value in before.items():
            if name not in EXTENDING and now.get(name) != value:
                raise WorkbenchError(
                    f"{origin}: {CONFIG_RECORD} says {name} {now.get(name)}, the checkpoint {value}; "
                    "a resumed training keeps its settings"
                )


def _flat(record: Any, origin: str) -> dict[str, Any]:
    """As JSON has it, where there are no tuples."""
    found = record if isinstance(record, dict) else {}
    parts = [found.get(name) for name in ("run", "hyperparameters")]
    if "algorithm" not in found or not all(isinstance(each, dict) for each in parts):
        raise WorkbenchError(f"{origin} isn't a training of this version")
    plain = json.loads(json.dumps(record))
    # Earlier records have some in both; the run's counts.
    values = {"algorithm": plain["algorithm"], **plain["hyperparameters"], **plain["run"]}
    return {RECORDED_AS.get(name, name): value for name, value in values.items()}


def known_options(kind: AlgorithmKind) -> Options:
    """All options of an algorithm's trainings.

    Raises:
        WorkbenchError: if the algorithm isn't installed.
    """
    kind.check_installed()
    return Options(RunOptions, kind.hyperparameters())


def make_options(
    kind: AlgorithmKind, values: dict[str, Any], resume: Path | None = None
) -> TrainingOptions:
    """From values that were read already; what isn't given keeps its default.

    Raises:
        WorkbenchError: if a value is beyond its limits.
    """
    options = known_options(kind)
    merged = until_the_steps({"exp_name": kind.name, **kind.defaults}, values)
    hyperparameters = options.make(kind.hyperparameters(), merged)
    run = options.make(RunOptions, merged)
    count = run.num_envs
    if count > 1 and not kind.learns_in_several:
        raise WorkbenchError(f"{kind.name} learns in one environment: num_envs is 1, not {count}")
    return TrainingOptions(kind, run, hyperparameters, resume)


def choose(
    kind: AlgorithmKind,
    flags: list[str],
    parameters: dict[str, Any] | None = None,
    prog: str = "rl-workbench train",
    env_id: str | None = None,
    parents: Sequence[argparse.ArgumentParser] = (),
) -> TrainingOptions:
    """Defaults, overridden by the file, --params, rosparams and flags, in this order.

    Args:
        flags: as on the command line.
        parameters: ROS parameters of the node that trains, if it is one.
        prog: the command, for --help.
        env_id: the environment if none is given.
        parents: have further flags, which were read already; --help shows them.

    Raises:
        SystemExit: with code 2 and a usage line, if a flag is wrong; with 0 after --help.
        WorkbenchError: if a name is unknown or a value wrong anywhere else.
    """
    options = known_options(kind)
    default = env_id or kind.defaults.get("env_id", RunOptions.env_id)
    line = CommandLine(kind, options, prog, default, parents)
    given, special, session = line.given(flags, parameters or {})
    if "resume" in special:
        old = resumed(kind, Path(special["resume"]), given, special)
        return old._replace(session=session)
    origin = f"--config {special['config']}" if "config" in special else f"config/{kind.config}"
    path = Path(special["config"]) if "config" in special else default_file(kind.config)
    preset = special.get("preset")
    wanted = given.get("env_id", None if preset else default)
    section = read_section(path, section_names(kind.section, wanted), preset)
    merged = ({"env_id": wanted} if wanted else {}) | options.read(section, origin)
    return make_options(kind, until_the_steps(merged, given))._replace(session=session)


def resumed(
    kind: AlgorithmKind, folder: Path, given: dict[str, Any], special: dict[str, str]
) -> TrainingOptions:
    """The options of the training in a folder, which may be prolonged.

    Raises:
        WorkbenchError: if there is none, it is another algorithm's, or others are given.
    """
    others = [name for name in given if name not in EXTENDING]
    others += [name for name in special if name != "resume"]
    if others:
        raise WorkbenchError(
            f"a resumed training keeps its settings: --resume allows no {flag(others[0])}, "
            f"only {', '.join(flag(name) for name in EXTENDING)}"
        )
    record = read_record(folder)
    old = options_of(kind, record, str(folder / CONFIG_RECORD))
    values = asdict(old.run) | asdict(old.hyperparameters)
    return make_options(kind, until_the_steps(values, given), folder)


def until_the_steps(values: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The values with those that were given: steps without episodes mean until the steps."""
    counted = {"episodes": 0} if given.get("total_timesteps") else {}
    return {**values, **counted, **given}


def options_of(kind: AlgorithmKind, content: Any, origin: str) -> TrainingOptions:
    """What `record` gave, also after JSON.

    Raises:
        WorkbenchError: if it is something else.
    """
    values = _flat(content, origin)
    name = values.pop("algorithm")
    if name != kind.name:
        raise WorkbenchError(f"{origin} is of a training by {name}, not by {kind.name}")
    return make_options(kind, known_options(kind).read(values, origin))
