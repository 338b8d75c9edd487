"""The command line of a training: a flag for each option, --config, --params and --resume."""

import argparse
import shlex
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.options import Options, key_values, unknown


def flag(name: str) -> str:
    """An option's flag."""
    return f"--{name.replace('_', '-')}"


class CommandOptions:
    """What was given: --params, overridden by rosparams, overridden by flags.

    Args:
        parser: already has what is this command's alone.
        options: get a flag and a rosparam each.
        config: name of the file that --config replaces.
        further: flags in `parser` that are rosparams, too, but no options.
    """

    def __init__(
        self,
        parser: argparse.ArgumentParser,
        options: Options,
        config: str,
        further: tuple[str, ...] = (),
    ) -> None:
        self.parser = parser
        self._special = ("config", "params", "resume", *further)
        self._options = options
        add = parser.add_argument
        suppress = argparse.SUPPRESS
        text = f"options in YAML (config/{config})"
        add("--config", metavar="FILE", default=suppress, help=text)
        text = "options by name"
        add("--params", metavar="KEY=VALUE", nargs="+", default=suppress, help=text)
        text = "go on with an interrupted training"
        add("--resume", metavar="RUN_DIR", default=suppress, help=text)
        options.add_flags(parser)

    def given(
        self, flags: list[str], parameters: dict[str, Any]
    ) -> tuple[dict[str, Any], dict[str, str]]:
        """Options that somebody gave, and the texts of --config, --resume and further flags.

        Raises:
            SystemExit: with code 2 and a usage line, if a flag is wrong; with 0 after --help.
            WorkbenchError: if a name is unknown or a value wrong anywhere else.
        """
        from_flags = self._read_flags(flags)
        known = [*self._special, *self._options.names]
        for name in parameters:
            if name not in known:
                raise WorkbenchError(f"rosparam: {unknown('parameter', name, known)}")
        special = {name: str(parameters[name]) for name in self._special if parameters.get(name)}
        own = {name: value for name, value in parameters.items() if name not in self._special}
        pairs = [*shlex.split(special.pop("params", "")), *from_flags.pop("params", [])]
        special |= {name: from_flags.pop(name) for name in self._special if name in from_flags}
        listed = self._options.read(key_values(pairs, "--params"), "--params")
        return listed | self._options.read(own, "rosparam") | from_flags, special

    def _read_flags(self, flags: list[str]) -> dict[str, Any]:
        known, strange = self.parser.parse_known_args(flags)
        if strange:
            names = [flag(name) for name in (*self._special, *self._options.names)]
            self.parser.error(unknown("flag", strange[0].partition("=")[0], names))
        return vars(known)
