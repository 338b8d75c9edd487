"""Programs that ros_utils starts: remembered by all processes, ended completely, nobody else's."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from ros_utils import ros_launch, ros_node
from ros_utils._internal import processes as _processes
from ros_utils._internal import programs as _programs
from ros_utils._internal.programs import CannotStart

SLEEP = ["sleep", "1000"]
BOUND = 60.0  # [s] for anything that a test waits for


@pytest.fixture(autouse=True)
def place(no_master, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(_processes, "LEFTOVERS", 0.3)  # a shell's background jobs ignore SIGINT
    yield tmp_path
    _programs.end(_programs.started())


def runs(pid):
    with contextlib.suppress(psutil.NoSuchProcess):
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    return False


def wait_until(condition):
    deadline = time.monotonic() + BOUND
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def read_number(path: Path) -> int:
    wait_until(lambda: path.exists() and path.read_text().endswith("\n"))
    return int(path.read_text())


def python(code, *arguments):
    """A Python process with the test's environment."""
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)


STARTER = """
import signal, sys, time
from ros_utils._internal import programs
print(programs.start(["sleep", "1000"], "node", "sleeper").process.pid, flush=True)
signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
if "stay" in sys.argv:
    signal.pause()
sys.stdin.read()
"""


def test_what_is_started_has_its_session_is_remembered_and_forgotten_once_ended():
    handle = _programs.start(SLEEP, "node", "sleeper")
    assert os.getsid(handle.process.pid) == handle.process.pid
    assert _programs.started() == [handle.start]
    assert _programs.end(_programs.started())
    assert not runs(handle.process.pid)
    assert _programs.started() == []


LINGERING = """
import ctypes, threading, time
threading.Thread(target=time.sleep, args=(1.0,)).start()
ctypes.CDLL(None).pthread_exit(None)
"""


def test_a_program_whose_threads_outlive_its_main_thread_has_ended_when_it_is_said_so():
    handle = _programs.start([sys.executable, "-c", LINGERING], "node", "lingering")
    wait_until(lambda: not runs(handle.process.pid))  # for /proc it is a zombie already
    assert handle.exit_code() is None
    assert _programs.end(_programs.started())
    assert handle.exit_code() is not None


@pytest.mark.slow
@pytest.mark.parametrize("orphaned", [False, True])
def test_children_in_other_sessions_are_ended_too_and_those_of_a_killed_parent(place, orphaned):
    code = "setsid sleep 1000 & echo $! > $0; wait"
    handle = _programs.start(["sh", "-c", code, str(place / "pid")], "launch", "parent")
    child = read_number(place / "pid")
    if orphaned:
        handle.process.kill()
        handle.process.wait()
        assert runs(child)
    assert ros_node.ros_kill_all_processes() if orphaned else _programs.end([handle.start])
    assert not runs(child)


def test_another_masters_processes_are_not_touched(monkeypatch):
    handle = _programs.start(SLEEP, "node", "sleeper")
    mine = os.environ["ROS_MASTER_URI"]
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    assert ros_node.ros_kill_all_processes()
    assert runs(handle.process.pid)
    monkeypatch.setenv("ROS_MASTER_URI", mine)


def test_names_of_this_machine_mean_the_same_master(monkeypatch):
    handle = _programs.start(SLEEP, "node", "sleeper")
    address = os.environ["ROS_MASTER_URI"].replace("127.0.0.1", "localhost")
    monkeypatch.setenv("ROS_MASTER_URI", address)
    assert _programs.started() == [handle.start]


@pytest.mark.parametrize(("trap", "number"), [("INT", signal.SIGTERM), ("INT TERM", signal.SIGKILL)])
def test_a_stubborn_program_is_ended(place, monkeypatch, trap, number):
    monkeypatch.setitem(_processes.END_PATIENCE, "node", 0.3)
    monkeypatch.setattr(_processes, "AFTER_TERM", 0.3 if number == signal.SIGKILL else BOUND)
    code = "import signal; [signal.signal(getattr(signal, 'SIG' + n), signal.SIG_IGN)"
    code += f" for n in '{trap}'.split()]; open({str(place / 'pid')!r}, 'w').write('1\\n'); "
    handle = _programs.start([sys.executable, "-c", code + "signal.pause()"], "node", "stubborn")
    read_number(place / "pid")
    assert _programs.end([handle.start])
    assert handle.process.returncode == -number


def test_another_process_ends_it():
    handle = _programs.start(SLEEP, "node", "sleeper")
    code = "from ros_utils import ros_node; assert ros_node.ros_kill_all_processes()"
    assert python(code).wait(BOUND) == 0
    assert handle.process.wait(BOUND) == -signal.SIGINT


@pytest.mark.parametrize("number", [None, signal.SIGINT, signal.SIGKILL])
def test_nothing_is_left_when_the_starter_ends(number):
    """By itself, by sys.exit in a handler of Ctrl-C, or killed outright."""
    starter = python(STARTER, *(["stay"] if number else []))
    pid = int(starter.stdout.readline())
    wait_until(lambda: Path(f"/proc/{pid}/comm").read_text() == "sleep\n")
    if number:
        starter.send_signal(number)
    starter.communicate(timeout=BOUND)
    wait_until(lambda: not runs(pid))


SLOW_TO_END = """
import pathlib, signal, sys, time
signal.signal(signal.SIGTERM, lambda *_: (time.sleep(0.5), sys.exit(0)))
pathlib.Path(sys.argv[1]).write_text("1\\n")
while True:
    signal.pause()
"""


@pytest.mark.parametrize("stubborn", [False, True])
def test_a_launch_whose_caller_was_killed_is_waited_for(place, monkeypatch, stubborn):
    """Its master is about to end: what is started now must not take it for its own."""
    program = SLOW_TO_END.replace("0.5", "1000") if stubborn else SLOW_TO_END
    monkeypatch.setitem(_processes.END_PATIENCE, "launch", 0.3 if stubborn else BOUND)
    command = [sys.executable, "-c", program, str(place / "listens")]
    code = "from ros_utils._internal import programs as p; import signal;"
    starter = python(f"{code} p.start({command!r}, 'launch', 'slow'); signal.pause()")
    read_number(place / "listens")
    (entry,) = _programs.started()
    assert _programs.end_orphans() and _processes.family(entry.token), "its caller lives"
    starter.kill()
    starter.wait(BOUND)
    younger = python("import signal; signal.pause()")
    assert replace(entry, caller=younger.pid).is_orphan, "the id went to a younger process"
    younger.kill()
    assert _programs.end_orphans() and not _processes.family(entry.token)
    assert _programs.started() == []


def test_a_program_of_ours_does_not_end_itself(place):
    code = (
        "from ros_utils import ros_node; assert ros_node.ros_kill_all_processes();"
        f"open({str(place / 'done')!r}, 'w').write('1\\n')"
    )
    handle = _programs.start([sys.executable, "-c", code], "node", "tidy")
    read_number(place / "done")
    assert handle.process.wait(BOUND) == 0


def test_killing_without_a_master_waits_for_nothing(monkeypatch):
    def sleep(seconds):
        raise AssertionError(f"it waits for {seconds} s")

    monkeypatch.setattr(time, "sleep", sleep)
    assert ros_node.ros_kill_all_processes()
    assert ros_node.ros_kill_master()
    assert ros_launch.ros_kill_launch_process()


def test_output_goes_to_a_log_and_its_error_is_the_reason():
    code = "echo one; echo 'ValueError: two'; echo three; exit 3"
    handle = _programs.start(["sh", "-c", code], "node", "talker")
    handle.process.wait(BOUND)
    assert handle.exit_code() == 3
    assert handle.reason() == "ValueError: two"
    assert handle.lines("t") == ["ValueError: two", "three"]


@pytest.mark.parametrize(
    ("command", "is_there", "text"),
    [
        (SLEEP, False, "sleeper: not there after 0.1 s; ended it: it said nothing"),
        (["sh", "-c", "exit 3"], False, "sleeper: ended with exit code 3"),
        (["true"], False, "sleeper: ended with exit code 0"),
        (SLEEP, True, ""),
    ],
)
def test_a_start_is_waited_for(capsys, command, is_there, text):
    handle = _programs.start(command, "node", "sleeper")
    timeout = BOUND if command is not SLEEP else 0.1
    wait = (handle, lambda: is_there, "not there", timeout, None)
    started = _programs.await_start(*wait, may_end=False)
    assert bool(started) is is_there
    assert text in capsys.readouterr().err


def test_a_missing_program_is_refused():
    with pytest.raises(CannotStart, match="nix"):
        _programs.start(["/nix"], "node", "nix")


@pytest.mark.parametrize("code", [0, 7])
def test_in_a_window_the_programs_exit_code_is_known(place, monkeypatch, code):
    xterm = place / "xterm"  # in the place of the real one: runs what follows -e
    xterm.write_text('#!/bin/sh\nwhile [ "$1" != -e ]; do shift; done; shift; "$@"\n')
    xterm.chmod(0o755)
    monkeypatch.setenv("PATH", f"{place}:{os.environ['PATH']}")
    monkeypatch.setenv("DISPLAY", ":0")
    handle = _programs.start(["sh", "-c", f"exit {code}"], "node", "a 'quoted' name", window=True)
    handle.process.wait(BOUND)
    assert handle.exit_code() == code


def test_without_a_display_a_window_falls_back_to_a_log(capsys):
    handle = _programs.start(["echo", "hello"], "node", "greeter", window=True)
    handle.process.wait(BOUND)
    assert handle.lines() == ["hello"]
    assert handle.log in capsys.readouterr().out
