"""The command line of a training: a flag for each option, --config, --params and --resume."""

import argparse
import shlex
from collections.abc import Sequence
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.kind import AlgorithmKind
from rl_workbench.training.options.options import (
    RENAMED,
    Options,
    key_values,
    unknown,
    unknown_option,
)
from rl_workbench.training.options.session import SessionOptions

USAGE = "{prog} [--help] [--OPTION VALUE ...]"
DESCRIPTION = """\
Trains {about}.

What isn't given comes from config/{config}, the environment's section, else it is the default.
--params wins over the file, {ros}and a flag over all of them.
Ctrl-C saves everything and exits with 130 (SIGTERM: 143, SIGHUP: 129, SIGXCPU: 152); --resume goes on from
there, to the same bits as a training that was never interrupted.
Exit codes: 0 done, 1 failed (what was learned is saved), 2 wrong arguments."""


def flag(name: str) -> str:
    """An option's flag."""
    return f"--{name.replace('_', '-')}"


def check_flag(parser: argparse.ArgumentParser, given: str) -> None:
    """Tells the name of today of a flag that earlier versions had.

    Raises:
        SystemExit: if it is one.
    """
    for old, new in RENAMED.items():
        if given == flag(old):
            parser.error(f"{given} is called {flag(new)} now")


class CommandLine:
    """What was given: --params, overridden by ROS parameters, overridden by flags.

    Args:
        kind: the algorithm.
        options: all of its options; each gets a flag, and a ROS parameter.
        prog: the command, for --help.
        env_id: the environment, if it isn't given.
        parents: have further flags, for --help.
    """

    def __init__(
        self,
        kind: AlgorithmKind,
        options: Options,
        prog: str,
        env_id: str,
        parents: Sequence[argparse.ArgumentParser] = (),
    ) -> None:
        self._options = options
        self._session = Options(SessionOptions)
        self._special = ("config", "params", "resume", *(("preset",) if kind.presets else ()))
        is_node = prog.endswith(".py")
        self.parser = argparse.ArgumentParser(
            prog,
            usage=USAGE.format(prog=prog),
            description=DESCRIPTION.format(
                about=kind.about,
                config=kind.config,
                ros="under roslaunch a private ROS parameter over --params, " if is_node else "",
            ),
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
            argument_default=argparse.SUPPRESS,
            parents=list(parents),
        )
        add = self.parser.add_argument
        add("--config", metavar="FILE", help=f"options in YAML (config/{kind.config})")
        if kind.presets:
            add("--preset", metavar="NAME", help="a section of that file, as in: tutorial")
        add("--params", metavar="KEY=VALUE", nargs="+", help="options by name")
        add("--resume", metavar="RUN_DIR", help="go on with an interrupted training")
        defaults = {"exp_name": kind.name, **kind.defaults, "env_id": env_id}
        options.add_flags(self.parser, defaults)
        self._session.add_flags(self.parser)

    def given(
        self, flags: list[str], parameters: dict[str, Any]
    ) -> tuple[dict[str, Any], dict[str, str], SessionOptions]:
        """Options that somebody gave, the texts of --config, --preset and --resume, and what holds this time.

        Raises:
            SystemExit: with code 2 and a usage line, if a flag is wrong; with 0 after --help.
            WorkbenchError: if a name is unknown or a value wrong anywhere else.
        """
        from_flags = self._read_flags(flags)
        known = [*self._special, *self._options.names, *self._session.names]
        for name in parameters:
            if name not in known:
                raise WorkbenchError(f"rosparam: {unknown_option(name, known, 'parameter')}")
        special = {name: str(parameters[name]) for name in self._special if parameters.get(name)}
        own = {name: value for name, value in parameters.items() if name in self._options.names}
        here = {name: value for name, value in parameters.items() if name in self._session.names}
        here = self._session.read(here, "rosparam")
        here |= {name: from_flags.pop(name) for name in self._session.names if name in from_flags}
        pairs = [*shlex.split(special.pop("params", "")), *from_flags.pop("params", [])]
        special |= {name: from_flags.pop(name) for name in self._special if name in from_flags}
        listed = self._options.read(key_values(pairs, "--params"), "--params")
        given = listed | self._options.read(own, "rosparam") | from_flags
        return given, special, SessionOptions(**here)

    def _read_flags(self, flags: list[str]) -> dict[str, Any]:
        known, strange = self.parser.parse_known_args(flags)
        if strange:
            given = strange[0].partition("=")[0]
            check_flag(self.parser, given)
            options = (*self._special, *self._options.names, *self._session.names)
            names = [flag(name) for name in options]
            self.parser.error(unknown("flag", given, names))
        return vars(known)
