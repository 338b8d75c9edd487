"""The flags of a training, and what wins: a flag, a parameter, --params, the file, the default."""

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import Options, key_values, unknown
from rl_workbench.training.algorithms import ALGORITHMS, AlgorithmKind, algorithm
from rl_workbench.training.options import (
    EXTENDING,
    RunOptions,
    SessionOptions,
    TrainingOptions,
    default_file,
    known_options,
    make_options,
    read_section,
    recorded_kind,
    resumed_options,
    section_names,
    until_the_steps,
)

PROG = "rl-workbench train"
USAGE = "{prog} [--help] [--OPTION VALUE ...]"
DESCRIPTION = """\
Trains {about}.

An option that isn't given comes from the environment's section in config/{config}, or else is the default.
--params overrides the file, a parameter from outside (as a launch file sets it) overrides --params, and a
flag overrides all of them.
Ctrl-C saves everything and exits with 130 (SIGTERM: 143, SIGHUP: 129, SIGXCPU: 152). --resume continues from
there and ends bit-identical to a training that was never interrupted.
Exit codes: 0 done, 1 failed (what was learned is saved), 2 wrong arguments."""
EPILOG = """\
dqn, reinforce and reinforce-document are our own, the others are Stable-Baselines3's.
Each has flags of its own: --algo NAME --help shows them."""
SESSION = Options(SessionOptions)


def flag(name: str) -> str:
    """Returns an option's flag."""
    return f"--{name.replace('_', '-')}"


def choose_training(
    argv: list[str],
    parameters: dict[str, Any] | None = None,
    prog: str = PROG,
    default: str | None = None,
    env_id: str | None = None,
    parent: argparse.ArgumentParser | None = None,
) -> TrainingOptions:
    """Reads a command line. It finds --algo first, since the other flags depend on it.

    Args:
        argv: The arguments without the command.
        parameters: Options from outside, see `choose`.
        prog: The command, for `--help`.
        default: The algorithm if none is named.
        env_id: The environment if none is named.
        parent: Has further flags to show in `--help`. The caller has parsed them.

    Raises:
        SystemExit: With code 2 and a usage line if the flags are wrong; with 0 after `--help`.
        WorkbenchError: If a name is unknown or a value is wrong anywhere else.
    """
    parser, parameters = algorithm_parser(prog), dict(parameters or {})
    known, rest = parser.parse_known_args(argv)
    named = getattr(known, "algo", None) or parameters.pop("algo", None) or None
    resume_flag = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    resume_flag.add_argument("--resume", nargs="?")
    resumed = resume_flag.parse_known_args(rest)[0].resume or parameters.get("resume")
    parents = [parser, *([parent] if parent else [])]
    if named is None and resumed:
        return choose(recorded_kind(Path(resumed)), rest, parameters, prog, env_id, parents)
    if named is None and default is None:
        _refuse_without_algorithm(parser, rest)
    try:
        kind: AlgorithmKind = algorithm(named or str(default))
    except WorkbenchError as error:
        parser.error(str(error))
    return choose(kind, rest, parameters, prog, env_id, parents)


def algorithm_parser(prog: str) -> argparse.ArgumentParser:
    """Makes the parser of --algo alone."""
    result = argparse.ArgumentParser(
        prog,
        usage=USAGE.format(prog=prog),
        description="Trains an agent.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        add_help=False,  # --algo NAME --help is the algorithm's
        argument_default=argparse.SUPPRESS,
    )
    names = ", ".join(ALGORITHMS)
    result.add_argument("--algo", metavar="NAME", help=f"one of {names}; each has flags of its own")
    return result


def _refuse_without_algorithm(parser: argparse.ArgumentParser, rest: list[str]) -> NoReturn:
    if "-h" in rest or "--help" in rest:
        parser.print_help()
        parser.exit()
    parser.error(f"--algo is missing, one of {', '.join(ALGORITHMS)}")


def choose(
    kind: AlgorithmKind,
    flags: list[str],
    parameters: dict[str, Any] | None = None,
    prog: str = PROG,
    env_id: str | None = None,
    parents: Sequence[argparse.ArgumentParser] = (),
) -> TrainingOptions:
    """Reads the options of one algorithm.

    Args:
        kind: The algorithm.
        flags: As on the command line.
        parameters: Options from outside, as a launch file sets them: between --params and the flags.
        prog: The command, for `--help`.
        env_id: The environment if none is given.
        parents: Have further flags to show in `--help`. The caller has parsed them.

    Raises:
        SystemExit: With code 2 and a usage line if a flag is wrong; with 0 after `--help`.
        WorkbenchError: If a name is unknown or a value is wrong anywhere else.
    """
    options = known_options(kind)
    default = env_id or kind.defaults.get("env_id", RunOptions.env_id)
    special = ("config", "params", "resume", *(("preset",) if kind.presets else ()))
    known = [*special, *options.names, *SESSION.names]
    from_flags = _parse(_parser(kind, options, prog, default, parents), flags, known)
    parameters = parameters or {}
    for name in parameters:
        if name not in known:
            raise WorkbenchError(f"parameters: {unknown('parameter', name, known)}")

    # What isn't an option of the training: files, presets, and what holds for this session only.
    files = {name: str(parameters[name]) for name in special if parameters.get(name)}
    pairs = [*shlex.split(files.pop("params", "")), *from_flags.pop("params", [])]
    files |= {name: from_flags.pop(name) for name in special if name in from_flags}
    here = SESSION.read(_of(SESSION, parameters), "parameters")
    here |= {name: from_flags.pop(name) for name in SESSION.names if name in from_flags}
    session = SessionOptions(**here)

    given = options.read(key_values(pairs, "--params"), "--params")
    given |= options.read(_of(options, parameters), "parameters") | from_flags
    if "resume" in files:
        others = [name for name in given if name not in EXTENDING]
        others += [name for name in files if name != "resume"]
        if others:
            raise WorkbenchError(
                f"a resumed training keeps its settings: --resume allows no {flag(others[0])}, "
                f"only {', '.join(flag(name) for name in EXTENDING)}"
            )
        return resumed_options(kind, Path(files["resume"]), given)._replace(session=session)

    preset = files.get("preset")
    path = Path(files["config"]) if "config" in files else default_file(kind.config)
    origin = f"--config {path}" if "config" in files else f"config/{kind.config}"
    env_id = given.get("env_id", None if preset else default)
    section = read_section(path, section_names(kind.section, env_id), preset)
    merged = ({"env_id": env_id} if env_id else {}) | options.read(section, origin)
    return make_options(kind, until_the_steps(merged, given))._replace(session=session)


def _of(options: Options, values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if name in options.names}


def _parser(
    kind: AlgorithmKind,
    options: Options,
    prog: str,
    env_id: str,
    parents: Sequence[argparse.ArgumentParser],
) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog,
        usage=USAGE.format(prog=prog),
        description=DESCRIPTION.format(about=kind.about, config=kind.config),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        argument_default=argparse.SUPPRESS,
        parents=list(parents),
    )
    add = parser.add_argument
    add("--config", metavar="FILE", help=f"options in YAML (default config/{kind.config})")
    if kind.presets:
        add("--preset", metavar="NAME", help="a section of that file by its name, as in: tutorial")
    add("--params", metavar="KEY=VALUE", nargs="+", help="options by name")
    add("--resume", metavar="RUN_DIR", help="continue an interrupted training")
    options.add_flags(parser, {"exp_name": kind.name, **kind.defaults, "env_id": env_id})
    SESSION.add_flags(parser)
    return parser


def _parse(
    parser: argparse.ArgumentParser, flags: list[str], known: Sequence[str]
) -> dict[str, Any]:
    found, strange = parser.parse_known_args(flags)
    if strange:
        name = strange[0].partition("=")[0]
        parser.error(unknown("flag", name, [flag(each) for each in known]))
    return vars(found)
