"""The command `train`, and the same from Python.

What wins: a flag, a parameter from outside, --params, the file with tuned options, the default.
"""

import argparse
import shlex
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from typing import Any

from rl_workbench import starting
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import Options, key_values, unknown
from rl_workbench.starting import Interrupt, run_command
from rl_workbench.training.algorithms import ALGORITHMS, AlgorithmKind, algorithm
from rl_workbench.training.callbacks import Callback, load_callbacks
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
from rl_workbench.training.progress import warn

PROGRAM = starting.program("rl_workbench")
PROG = "rl-workbench train"
DESCRIPTION = """\
Trains {about}.

An option that isn't given comes from the environment's section in config/{config}, or else is the default.
--params overrides the file, a parameter from outside (as a launch file sets it) overrides --params, and a
flag overrides all of them.
Ctrl-C saves everything and exits with 130 (SIGTERM: 143, SIGHUP: 129, SIGXCPU: 152). --resume continues from
there and ends bit-identical to a training that was never interrupted.
Exit codes: 0 done, 1 failed (the error names the step up to which all is saved), 2 wrong arguments."""
EPILOG = """\
dqn, reinforce and reinforce-document are our own, the others are Stable-Baselines3's.
Each has flags of its own: --algo NAME --help shows them."""
SESSION = Options(SessionOptions)
SOURCES = ("config", "preset", "params", "resume")  # flags that name where options come from


def train(algo: str, callbacks: Sequence[Callback] = (), **options: Any) -> Path:
    """Trains an agent from Python, like `rl-workbench train`; returns the run folder.

        folder = train("dqn", env_id="CartPole-v1", total_timesteps=5000, callbacks=[Mine()])

    Args:
        algo: The algorithm, as `--algo` names it.
        callbacks: Called at the events of the training, see `Callback`.
        options: Options by name, as the flags with underscores; also `config`, `preset` and `resume`.

    Raises WorkbenchError if an option is wrong, or the training fails; what was learned is saved, up to the
    step that the text names.
    """
    return run_training(choose(algorithm(algo), [], options), Interrupt(), callbacks=callbacks)


def run_training(
    options: TrainingOptions,
    interrupt: Interrupt,
    begin: Callable[[], object] = lambda: None,
    callbacks: Sequence[Callback] = (),
) -> Path:
    """Trains into the options' folder, or a new one below runs/; returns it.

    `begin` is called before the training begins, to start what goes beside it. `callbacks` are further ones
    than those that the options name. Raises WorkbenchError if something fails that the user
    can mend; what was learned is saved, up to the step that the text names.
    """
    with interrupt.reading():  # both are slow to import, and --help needs neither
        from rl_workbench.training import folder as run_folder
        from rl_workbench.training.training import Training

        import_module(options.kind.implementation)

    callbacks = [*callbacks, *load_callbacks(options.session.callback)]
    run = options.run
    try:
        with ExitStack() as holding:
            if options.resume:
                folder = options.resume.resolve()
                holding.enter_context(run_folder.held(folder))
            else:
                place = (run.run_dir, run.env_id, run.exp_name, run.seed)
                folder = holding.enter_context(run_folder.opened(*place))
            begin()
            training = Training(options, folder, interrupt, callbacks)
            if doubt := options.doubt():
                warn(doubt)
            interrupt.defer()
            training.run()
    finally:
        interrupt.defer()
    return folder


def main(
    argv: list[str] | None = None,
    parameters: dict[str, Any] | None = None,
    prog: str = PROG,
    default: str | None = None,
    program: Sequence[str] = PROGRAM,
) -> int:
    """Trains as the arguments say; returns the exit code of the process.

    `default` is the algorithm if none is named, `parameters` are options from outside, as a launch file sets
    them. `program` starts the whole command line, for a page in a process of its own.
    """

    def command(interrupt: Interrupt) -> None:
        try:
            words = sys.argv[1:] if argv is None else argv
            options = choose_training(words, parameters, prog, default)
        except WorkbenchError as error:  # wrong arguments too, wherever they were written
            algorithm_parser(prog).error(str(error))
        run_training(options, interrupt, callbacks=page_of(options, program))

    return run_command(prog, command)


def page_of(options: TrainingOptions, program: Sequence[str]) -> list[Callback]:
    """Returns the callback that shows the training's page, if it was asked for."""
    if not options.session.gui:
        return []
    from rl_workbench.training.page import Page

    return [Page(program)]


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

    `default` is the algorithm if none is named. `parent` has further flags to show in `--help`, which the
    caller has parsed. The other arguments, and what is raised, are `choose`'s.
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
        if "-h" in rest or "--help" in rest:
            parser.print_help()
            parser.exit()
        parser.error(f"--algo is missing, one of {', '.join(ALGORITHMS)}")
    try:
        kind: AlgorithmKind = algorithm(named or str(default))
    except WorkbenchError as error:
        parser.error(str(error))
    return choose(kind, rest, parameters, prog, env_id, parents)


def new_parser(prog: str, **options: Any) -> argparse.ArgumentParser:
    """Makes a parser whose result lacks flags that aren't given."""
    return argparse.ArgumentParser(
        prog,
        usage=f"{prog} [--help] [--OPTION VALUE ...]",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        argument_default=argparse.SUPPRESS,
        **options,
    )


def algorithm_parser(prog: str) -> argparse.ArgumentParser:
    """Makes the parser of --algo alone."""
    # --algo NAME --help is the algorithm's
    result = new_parser(prog, description="Trains an agent.", epilog=EPILOG, add_help=False)
    names = ", ".join(ALGORITHMS)
    result.add_argument("--algo", metavar="NAME", help=f"one of {names}; each has flags of its own")
    return result


def choose(
    kind: AlgorithmKind,
    flags: list[str],
    parameters: dict[str, Any] | None = None,
    prog: str = PROG,
    env_id: str | None = None,
    parents: Sequence[argparse.ArgumentParser] = (),
) -> TrainingOptions:
    """Reads the options of one algorithm.

    `parameters` are options from outside, as a launch file sets them: between --params and the flags.
    `parents` have further flags to show in `--help`, which the caller has parsed. Exits with code 2 and a
    usage line if a flag is wrong, with 0 after `--help`; raises WorkbenchError if a name is unknown or a
    value wrong anywhere else.
    """
    options = known_options(kind)
    default = env_id or kind.defaults.get("env_id", RunOptions.env_id)
    known = [*SOURCES, *options.names, *SESSION.names]
    parser = _parser(kind, options, prog, default, parents)
    found, left = parser.parse_known_args(flags)
    if left:
        flags = [flag(each) for each in known]
        parser.error(unknown("flag", left[0].partition("=")[0], flags))
    from_flags = vars(found)
    parameters = parameters or {}
    if strange := [name for name in parameters if name not in known]:
        raise WorkbenchError(f"parameters: {unknown('parameter', strange[0], known)}")

    # What isn't an option of the training: files, presets, and what holds for this session only.
    files = {name: str(parameters[name]) for name in SOURCES if parameters.get(name)}
    pairs = [*shlex.split(files.pop("params", "")), *from_flags.pop("params", [])]
    files |= {name: from_flags.pop(name) for name in SOURCES if name in from_flags}
    here = SESSION.read(_of(SESSION, parameters), "parameters")
    here |= {name: from_flags.pop(name) for name in SESSION.names if name in from_flags}
    session = SessionOptions(**here)

    given = options.read(key_values(pairs, "--params"), "--params")
    given |= options.read(_of(options, parameters), "parameters") | from_flags
    if "resume" in files:
        for name in (*given, *files):
            if name not in (*EXTENDING, "resume"):
                raise WorkbenchError(
                    f"a resumed training keeps its settings: --resume allows no {flag(name)}, "
                    f"only {', '.join(map(flag, EXTENDING))}"
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
    kind: AlgorithmKind, options: Options, prog: str, env_id: str, parents: Sequence[argparse.ArgumentParser]
) -> argparse.ArgumentParser:
    about = DESCRIPTION.format(about=kind.about, config=kind.config)
    parser = new_parser(prog, description=about, parents=parents)
    add = parser.add_argument
    add("--config", metavar="FILE", help=f"options in YAML (default config/{kind.config})")
    add("--preset", metavar="NAME", help="section of that file to use, e.g. tutorial")
    add("--params", metavar="KEY=VALUE", nargs="+", help="options by name")
    add("--resume", metavar="RUN_DIR", help="continue an interrupted training")
    options.add_flags(parser, {"exp_name": kind.name, **kind.defaults, "env_id": env_id})
    SESSION.add_flags(parser)
    return parser
