"""Expanding xacro files within limits, and the program ``xacro``.

A xacro file is a program: it may include itself, compute without end or ask for all memory. So it runs in
a child process, with the xacro that the caller would import.
"""

import io
import json
import os
import re
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, suppress
from pathlib import Path
from typing import Any, NoReturn

from file_access import limited
from file_access.xml_text import decode, without_declaration

LIMITS = limited.Limits(
    processor_time=30,  # [s], far more than the largest robots in use need
    wall_time=60.0,
    memory=1 << 30,
    output=64 << 20,
)
MAX_REASON = 500  # characters
MAX_FILES = 3  # that an error names

BROKEN = 2  # exit code, xacro's own

_told: set[str] = set()  # xacro's warnings that this process has printed


class CannotExpand(Exception):
    """The file can't be expanded; the text is one line with the file, the place and the reason."""


def expand(
    path: str | os.PathLike[str], mappings: Mapping[str, str] | None = None, limits: limited.Limits = LIMITS
) -> str:
    """Returns the XML text of a URDF or xacro file; raises CannotExpand if it is broken or beyond a limit."""
    return _ask("xml", os.fspath(path), mappings, limits)


def included_files(path: str | os.PathLike[str], mappings: Mapping[str, str] | None = None) -> list[str]:
    """Returns the files that a xacro file includes, or takes numbers from; raises CannotExpand."""
    return _ask("files", os.fspath(path), mappings, LIMITS).splitlines()


def _ask(wanted: str, path: str, mappings: Mapping[str, str] | None, limits: limited.Limits) -> str:
    request = {"wanted": wanted, "path": path, "mappings": dict(mappings or {})}
    # A process for each file: xacro keeps its state in module variables.
    process = limited.LimitedProcess("file_access.expansion:answer", limits)
    try:
        answered = json.loads(process.ask(json.dumps(request).encode()))
        for line, more in answered["warnings"].items():
            if line not in _told:
                _told.add(line)
                print(line, *more, sep="\n", file=sys.stderr)
        return str(answered["text"])
    except limited.ProcessDied as fault:
        raise CannotExpand(f"{path}: xacro: {fault}") from fault
    except limited.RequestRefused as fault:
        text = str(fault)
        raise CannotExpand(text if path in text else f"{path}: xacro: {text}") from fault
    finally:
        process.close()


def answer(data: bytes) -> bytes:
    """Answers a request in the child process, in JSON: the XML or a file in each line, and warnings."""
    request = json.loads(data)
    path = request["path"]
    try:
        import xacro
    except ImportError as fault:
        raise ImportError(f"{fault}: is it installed?") from fault

    def parse(given: Any, name: str | None = None) -> Any:
        """Parses any encoding; xacro itself takes only UTF-8, and nothing before the declaration."""
        if given is None and name is not None:
            with suppress(OSError):  # xacro itself reports missing files
                given = without_declaration(decode(Path(name).read_bytes()))
        return xacro_parse(given, name)

    xacro_parse, xacro.parse = xacro.parse, parse
    with _heard() as warnings, _in_one_line(xacro, path):
        document = xacro.process_file(path, mappings=request["mappings"])
        if request["wanted"] == "files":
            text = "\n".join(sorted(set(xacro.all_includes)))
        else:
            text = document.toprettyxml(indent="  ")
    return json.dumps({"text": text, "warnings": warnings}).encode()


def main() -> int:
    """Runs the program ``xacro`` with its own options; returns its exit code."""
    worker = os.fork()
    if not worker:
        _run_program()
    signal.signal(signal.SIGTERM, lambda number, _: os.kill(worker, number))
    try:
        status = os.waitstatus_to_exitcode(os.waitpid(worker, 0)[1])
    except KeyboardInterrupt:  # which the worker got as well
        return 128 + signal.SIGINT
    if status == -signal.SIGPIPE:  # the reader has gone
        return 128 + signal.SIGPIPE
    if status < 0:
        print(f"xacro: {limited.why_ended(status, LIMITS)}", file=sys.stderr)
        return BROKEN
    return status


def _run_program() -> NoReturn:
    limited.limit_memory(LIMITS.memory)
    limited.limit_time(LIMITS.processor_time, LIMITS.wall_time)
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    import xacro

    options, path = xacro.process_args(sys.argv[1:])
    if options.root_dir:
        xacro.root_dir = options.root_dir
    try:
        with _heard() as warnings, _in_one_line(xacro, path):
            document = xacro.process_file(path, **vars(options))
        for line, more in warnings.items():
            print(line, *more, sep="\n", file=sys.stderr)
        with _in_one_line(xacro, path):
            if options.just_deps:
                text = " ".join(sorted(set(xacro.all_includes)))
            else:
                text = document.toprettyxml(indent="  ")
            with xacro.open_output(options.output) as output:  # only now: it may be in use so far
                output.write(text)
    except CannotExpand as fault:
        if options.verbosity > 1:
            raise
        print(f"xacro: {fault}", file=sys.stderr)
        sys.exit(BROKEN)
    sys.exit(0)


@contextmanager
def _heard() -> Iterator[dict[str, list[str]]]:
    """Collects xacro's warnings, each distinct one once, with the lines on its first place.

    Whatever else it writes to stderr is passed on.
    """
    lines: dict[str, list[str]] = {}
    heard = io.StringIO()
    try:
        with redirect_stderr(heard):
            yield lines
    finally:
        said, *warnings = re.split(r"^(?=warning: )", heard.getvalue(), flags=re.MULTILINE)
        sys.stderr.write(said)
        for each in warnings:
            line, *more = each.rstrip("\n").split("\n")
            lines.setdefault(line, more)


@contextmanager
def _in_one_line(xacro: Any, path: str) -> Iterator[None]:
    """Turns any exception inside the block into CannotExpand."""
    try:
        yield
    except Exception as fault:
        # xacro evaluates the file's own Python expressions, which may raise anything.
        raise CannotExpand(_what_went_wrong(xacro, path, fault)) from fault


def _what_went_wrong(xacro: Any, path: str, fault: Exception) -> str:
    """Returns one line: the file that xacro was reading, the files and macros that led there, the reason."""
    files = [str(file) for file in reversed(xacro.filestack or [path]) if file]
    macros = [macro.body.getAttribute("name") for macro in reversed(xacro.macrostack or [])]
    through = [f"included from {file}" for file in files[1:]] + [f"in macro {m}" for m in macros]
    if len(through) > MAX_FILES:
        through[MAX_FILES:] = [f"and {len(through) - MAX_FILES} more"]
    chain: list[BaseException] = [fault]  # xacro wraps what it meets in exceptions of its own
    while chain[-1].__context__ is not None:
        chain.append(chain[-1].__context__)
    if any(isinstance(each, RecursionError) for each in chain):
        reason = "nested without end: does a file include itself, or a macro call itself?"
    elif any(isinstance(each, MemoryError) for each in chain):
        reason = f"needs more than {LIMITS.memory >> 20} MiB of memory"
    else:
        missing = getattr(fault, "exc", None)  # of xacro's own exception, which repeats its text
        if isinstance(missing, OSError) and missing.filename and missing.strerror:
            own = missing.filename == files[0]
            fault = Exception(missing.strerror + ("" if own else f": {missing.filename}"))
        if missing is not None and type(missing).__name__ == "PackageNotFoundError":
            fault = Exception(missing.args[0])  # of $(find ...); xacro repeats it, with the class
        text = " ".join(str(fault.args[0] if isinstance(fault, KeyError) else fault).split())
        reason = text[:MAX_REASON] or type(fault).__name__
    return f"{', '.join([*files[:1], *through])}: {reason}"
