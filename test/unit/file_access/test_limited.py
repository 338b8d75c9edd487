"""A limited child process: what it answers, and what becomes of a request that goes too far."""

import os
import signal
import threading
from dataclasses import replace

import pytest

from file_access.limited import LimitedProcess, Limits, ProcessDied, RequestRefused

LIMITS = Limits(processor_time=1, wall_time=30.0, memory=512 << 20, output=1000)
PROGRAM = """
import os, signal

def answer(request):
    text = request.decode()
    return str(eval(text, {"os": os, "signal": signal})).encode()
"""


@pytest.fixture
def process(tmp_path, monkeypatch):
    (tmp_path / "evaluating.py").write_text(PROGRAM)
    monkeypatch.syspath_prepend(tmp_path)
    processes = []

    def make(limits=LIMITS):
        processes.append(LimitedProcess("evaluating:answer", limits))
        return processes[-1]

    yield make
    for each in processes:
        each.close()


def test_it_answers_again_and_again_from_one_process(process) -> None:
    child = process()
    pids = {int(child.ask(b"os.getpid()")) for _ in range(3)}
    assert len(pids) == 1 and os.getpid() not in pids
    child.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pids.pop(), 0)


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (b"1 / 0", "division by zero"),
        (b"int('a\\n' + 'b')", r"invalid literal .* 'a\\nb'"),
        (b"'a' * 10**10", "needs more than 512 MiB of memory"),
        (b"'a' * 10**4", "the result has more than"),
    ],
)
def test_an_error_refuses_a_request_and_the_next_one_is_answered(process, request_, reason) -> None:
    child = process()
    before = child.ask(b"os.getpid()")
    with pytest.raises(RequestRefused, match=f"^{reason}"):
        child.ask(request_)
    assert child.ask(b"os.getpid()") == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (b"9**9**9", "ended after 1 s of processor time"),
        (b"signal.pause()", "ended after 0.5 s: does it read a pipe"),
        (b"os.abort()", "ended by SIGABRT"),
        (b"os._exit(3)", "ended with exit code 3"),
    ],
)
def test_a_process_that_dies_is_started_again(process, request_, reason) -> None:
    child = process(replace(LIMITS, wall_time=0.5) if b"pause" in request_ else LIMITS)
    with pytest.raises(ProcessDied, match=reason):
        child.ask(request_)
    assert child.ask(b"1 + 1") == b"2"


def test_what_it_prints_is_no_answer(process) -> None:
    assert process().ask(b"[print('x'), os.write(1, b'y'), 7][-1]") == b"7"


def test_it_is_started_again_after_it_was_killed_between_two_requests(process) -> None:
    child = process()
    pid = int(child.ask(b"os.getpid()"))
    os.kill(pid, signal.SIGKILL)
    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    assert int(child.ask(b"os.getpid()")) != pid


def test_threads_take_turns_and_a_fork_has_a_process_of_its_own(process) -> None:
    child = process()
    answers = {}

    def ask(number: int) -> None:
        answers[number] = int(child.ask(str(number).encode()))

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(8)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert answers == {number: number for number in range(8)}
    before = child.ask(b"os.getpid()")
    pid = os.fork()
    if not pid:
        os._exit(0 if child.ask(b"os.getpid()") != before else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
    assert child.ask(b"os.getpid()") == before
