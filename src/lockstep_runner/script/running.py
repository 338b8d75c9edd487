"""Runs a Python file as if it had been started by itself."""

from __future__ import annotations

import ast
import builtins
import os
import re
import sys
import tokenize
import types
from collections.abc import Sequence

PYTHON_2 = re.compile(r"<>|^\s*raise [\w.]+,|\bur['\"]|`")
MODULES_OF_PYTHON_2 = frozenset(
    ["ConfigParser", "Queue", "StringIO", "Tkinter", "__builtin__", "cPickle", "thread", "urllib2"]
)
NAMES_OF_PYTHON_2 = frozenset(
    ["basestring", "execfile", "long", "raw_input", "reduce", "unichr", "unicode", "xrange"]
)
OURS = __name__.partition(".")[0]


class NoScript(Exception):
    """The file can't be run; the text says why."""


def compiled(path: str) -> types.CodeType:
    """Reads and compiles a script.

    Raises:
        NoScript: it can't be read, or isn't Python 3.
    """
    try:
        with tokenize.open(path) as file:
            source = file.read()
        return compile(ast.parse(source, path), path, "exec", dont_inherit=True)
    except (OSError, UnicodeDecodeError) as fault:
        raise NoScript(f"{path}: {fault}") from fault
    except (SyntaxError, ValueError) as fault:
        what, line, place = str(fault), "", ""
        if isinstance(fault, SyntaxError):
            what, line, place = fault.msg, fault.text or "", f", line {fault.lineno}"
        hint = ""
        if _is_for_python_2(what, line):
            hint = " (a script for Python 2: this is Python 3; 2to3 mends most of it)"
        raise NoScript(f"{path}{place}: {what}{hint}") from fault


def _is_for_python_2(fault: str, line: str) -> bool:
    signs = (
        "Missing parentheses in call to 'print'",
        "Missing parentheses in call to 'exec'",
        "multiple exception types must be parenthesized",
        "leading zeros in decimal integer literals",
        "invalid decimal literal",
        "inconsistent use of tabs",
    )
    return any(sign in fault for sign in signs) or PYTHON_2.search(line) is not None


def hint(fault: BaseException) -> str:
    """What a script that reads as Python 3 means by a name of Python 2; empty for other faults."""
    missing = fault.name if isinstance(fault, ImportError | NameError) else None
    if missing in MODULES_OF_PYTHON_2 | NAMES_OF_PYTHON_2:
        return f"{missing} is Python 2's: the script is for Python 2, this is Python 3; 2to3 mends most of it"
    return ""


def run(path: str, arguments: Sequence[str], code: types.CodeType) -> None:
    """Runs a script as `__main__`, with its arguments, from the folder where we are.

    What it raises goes up; `own_part` takes ours out of the traceback.
    """
    main = types.ModuleType("__main__")
    main.__dict__.update(__file__=path, __builtins__=builtins, __cached__=None)
    sys.modules["__main__"] = main
    sys.argv = [path, *arguments]
    sys.path[0] = os.path.dirname(os.path.realpath(path))
    exec(code, main.__dict__)


def own_part(trace: types.TracebackType | None, path: str) -> types.TracebackType | None:
    """A traceback from the script's first frame on, without those that are replaced functions'."""
    part = trace
    while part is not None and part.tb_frame.f_code.co_filename != path:
        part = part.tb_next
    if part is None:
        return trace
    last = part
    while last.tb_next is not None:
        name = last.tb_next.tb_frame.f_globals.get("__name__", "")
        if name.partition(".")[0] == OURS:
            last.tb_next = last.tb_next.tb_next
        else:
            last = last.tb_next
    return part
