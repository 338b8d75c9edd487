"""Expands one xacro file within limits: the process that `expansion` starts, and the program ``xacro``.

A xacro file is a program: it may include itself, compute without end or ask for all memory. It runs here,
where the kernel ends it, and not in whoever asks for it.

`expansion` runs this file by itself (``python -I``), so it imports nothing of this repository before the
request has come: JSON on standard input, with the path of its caller's modules. The answer on standard output
is the XML or the names of the files that it includes; with exit code `BROKEN`, one line that says what is
wrong.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

PROCESSOR_TIME = 30  # [s], far more than the largest robots in use need
WALL_TIME = 60.0  # [s], for a file that never ends: a pipe, a drive that is gone
MEMORY = 1 << 30  # [bytes] of address space
OUTPUT = 64 << 20  # [bytes] of XML
TEXT = 500  # characters of a reason
FILES = 3  # that a text names

BROKEN = 2  # exit code, xacro's own


class _Broken(Exception):
    """The file can't be expanded; the text is one line."""


def main() -> int:
    """The program ``xacro`` with its own options; returns its exit code."""
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
        print(f"xacro: {ended_by(-status, PROCESSOR_TIME, WALL_TIME)}", file=sys.stderr)
        return BROKEN
    return status


def ended_by(number: int, processor_time: int, wall_time: float) -> str:
    """One line on a process that a signal has ended."""
    if number == signal.SIGXCPU:
        return f"ended after {processor_time} s of processor time: does it compute without end?"
    if number == signal.SIGALRM:
        return f"ended after {wall_time:g} s: does it read a pipe, or a drive that is gone?"
    return f"ended by {signal.Signals(number).name}"


def _run_program() -> NoReturn:
    _set_limits(PROCESSOR_TIME, WALL_TIME, MEMORY)
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    import xacro

    options, path = xacro.process_args(sys.argv[1:])
    if options.root_dir:
        xacro.root_dir = options.root_dir
    try:
        with _one_line(xacro, path, MEMORY):
            document = xacro.process_file(path, **vars(options))
            if options.just_deps:
                text = " ".join(sorted(set(xacro.all_includes)))
            else:
                text = document.toprettyxml(indent="  ")
            with xacro.open_output(options.output) as output:  # only now: it may be in use so far
                output.write(text)
    except _Broken as fault:
        if options.verbosity > 1:
            raise
        print(f"xacro: {fault}", file=sys.stderr)
        sys.exit(BROKEN)
    sys.exit(0)


def _answer_request() -> NoReturn:
    request: dict[str, Any] = json.load(sys.stdin)
    answer = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a file prints is no XML
    _set_limits(request["processor_time"], request["wall_time"], request["memory"])
    sys.path[:] = request["sys_path"]
    path = request["path"]
    with answer:
        try:
            import xacro

            from files.xml_text import decode, without_declaration
        except ImportError as fault:
            answer.write(f"{fault}: is it installed?".encode())
            sys.exit(BROKEN)

        def parse(given: Any, name: str | None = None) -> Any:
            """xacro itself takes UTF-8, and nothing before the declaration."""
            if given is None and name is not None:
                with suppress(OSError):  # xacro has its own way with files that are missing
                    given = without_declaration(decode(Path(name).read_bytes()))
            return xacro_parse(given, name)

        xacro_parse, xacro.parse = xacro.parse, parse
        try:
            with _one_line(xacro, path, request["memory"]):
                document = xacro.process_file(path, mappings=request["mappings"])
                files = "\n".join(sorted(set(xacro.all_includes)))
                text = files if request["wanted"] == "files" else document.toprettyxml(indent="  ")
                told = text.encode(errors="surrogateescape")
                if len(told) > OUTPUT:
                    raise ValueError(f"expands to more than {OUTPUT >> 20} MiB")
        except _Broken as fault:
            answer.write(str(fault).encode(errors="replace"))
            sys.exit(BROKEN)
        answer.write(told)
    sys.exit(0)


def _set_limits(processor_time: int, wall_time: float, memory: int) -> None:
    """Let the kernel end this process where it goes too far; narrower limits stay.

    Args:
        processor_time: [s], then SIGXCPU.
        wall_time: [s], then SIGALRM.
        memory: [bytes] of address space; asking for more is a MemoryError.
    """
    signals = {signal.SIGINT, signal.SIGXCPU, signal.SIGALRM}
    for each in signals:
        signal.signal(each, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, signals)
    bounds = (
        (resource.RLIMIT_CPU, processor_time),
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_CORE, 0),
    )
    for kind, bound in bounds:
        soft, hard = resource.getrlimit(kind)
        if soft == resource.RLIM_INFINITY or soft > bound:
            resource.setrlimit(kind, (bound, hard))
    signal.setitimer(signal.ITIMER_REAL, wall_time)


@contextmanager
def _one_line(xacro: Any, path: str, memory: int) -> Iterator[None]:
    try:
        yield
    except Exception as fault:
        # xacro evaluates the file's own Python expressions: anything may come out.
        raise _Broken(_what_went_wrong(xacro, path, fault, memory)) from fault


def _what_went_wrong(xacro: Any, path: str, fault: Exception, memory: int) -> str:
    """One line: the file that xacro was reading, the files and macros that led there, the reason."""
    files = [str(file) for file in reversed(xacro.filestack or [path]) if file]
    macros = [macro.body.getAttribute("name") for macro in reversed(xacro.macrostack or [])]
    through = [f"included from {file}" for file in files[1:]] + [f"in macro {m}" for m in macros]
    if len(through) > FILES:
        through[FILES:] = [f"and {len(through) - FILES} more"]
    chain: list[BaseException] = [fault]  # xacro packs what it meets into exceptions of its own
    while chain[-1].__context__ is not None:
        chain.append(chain[-1].__context__)
    if any(isinstance(each, RecursionError) for each in chain):
        reason = "nested without end: does a file include itself, or a macro call itself?"
    elif any(isinstance(each, MemoryError) for each in chain):
        reason = f"needs more than {memory >> 20} MiB of memory"
    else:
        missing = getattr(fault, "exc", None)  # of xacro's own exception, which tells it twice
        if isinstance(missing, OSError) and missing.filename and missing.strerror:
            own = missing.filename == files[0]
            fault = Exception(missing.strerror + ("" if own else f": {missing.filename}"))
        text = " ".join(str(fault.args[0] if isinstance(fault, KeyError) else fault).split())
        reason = text[:TEXT] or type(fault).__name__
    return f"{', '.join([*files[:1], *through])}: {reason}"


if __name__ == "__main__":
    _answer_request()
