"""xacro files that never end, or ask for everything: one line, and the caller goes on."""

import os
import re
import signal
import subprocess
import sys
import threading
from dataclasses import replace

import pytest
from support import python

from file_access import expansion
from file_access.expansion import LIMITS, CannotExpand, expand, included_files
from robot_envs import files as descriptions
from robot_envs.errors import RobotEnvError
from ros_utils import ros_gazebo, ros_urdf

XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
ENDLESS = "${9**9**9}"
GREEDY = "${'a' * 10**10}"
MACRO = '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>'
TWICE = '<xacro:include filename="bad.xacro"/>' * 2
PROGRAM = "raise SystemExit(expansion.main())"


@pytest.fixture
def bad(tmp_path):
    def write(text):
        path = tmp_path / "bad.xacro"
        path.write_text(XACRO.format(text))
        return str(path)

    return write


@pytest.fixture
def short(monkeypatch):
    """One second instead of the usual limit."""
    monkeypatch.setattr(expand, "__defaults__", (None, replace(LIMITS, processor_time=1)))


def refused(path, **limits):
    with pytest.raises(CannotExpand) as caught:
        expand(path, limits=replace(LIMITS, **limits)) if limits else expand(path)
    assert str(caught.value).count("\n") == 0
    assert str(caught.value).startswith(path)
    assert len(str(caught.value)) < 1000 + 4 * len(path)
    return str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (ENDLESS, "1 s of processor time"),
        (GREEDY, "more than 1024 MiB"),
        ("${[0] * 10**9}", "more than 1024 MiB"),
        (MACRO, "in macro m, in macro m, in macro m, and .* more: nested without end"),
        (TWICE, "included from .*, and .* more: nested without end"),
        ("${'a' * 10**5}(${undefined})", "undefined"),
        ("${nix_" + "x" * 10**5 + "}", "nix_x"),
        ("<a b=\"${'a' * 7 * 10**7}\"/>", "more than 64 MiB"),
    ],
)
def test_a_file_without_bounds(bad, text, reason):
    assert re.search(reason, refused(bad(text), processor_time=1))


def test_a_file_that_is_missing_is_told_once(bad, tmp_path):
    assert refused(str(tmp_path / "none")) == f"{tmp_path}/none: No such file or directory"
    path = bad('<xacro:include filename="none.xacro"/>')
    assert refused(path) == f"{path}: No such file or directory: {tmp_path}/none.xacro"
    path = bad('<xacro:include filename="$(find no_such_package)/a.xacro"/>')
    assert refused(path) == (
        f"{path}: package 'no_such_package' not found on ROS_PACKAGE_PATH; "
        "./ws --with FOLDER ... finds those in FOLDER"
    )


def test_a_warning_is_told_once_with_its_first_place(bad, capfd):
    both = "".join(f'<xacro:property name="{name}" value="2"/>' for name in ("len", "max"))
    path = bad(f'<xacro:macro name="m">{both}</xacro:macro>' + "<xacro:m/>" * 9)
    expand(path)
    expand(path)
    told = capfd.readouterr().err
    assert [line for line in told.splitlines() if line.startswith("warning: ")] == [
        "warning: redefining global symbol: len",
        "warning: redefining global symbol: max",
    ]
    assert told.count("in file: ") == 2
    done = python.run_python(f"from file_access import expansion; {PROGRAM}", path)
    assert done.stderr == told and "<robot" in done.stdout


@pytest.mark.slow
def test_a_bomb_of_macros(bad):
    """Each macro calls the one before ten times."""
    macros = '<xacro:macro name="m0"><link/></xacro:macro>' + "".join(
        f'<xacro:macro name="m{n}">{f"<xacro:m{n - 1}/>" * 10}</xacro:macro>' for n in range(1, 9)
    )
    reason = refused(bad(macros + "<xacro:m8/>"), processor_time=1, memory=256 << 20)
    assert re.search("processor time|of memory", reason)


def test_a_pipe_that_nobody_writes(tmp_path):
    os.mkfifo(tmp_path / "pipe.xacro")
    assert "ended after 0.5 s" in refused(str(tmp_path / "pipe.xacro"), wall_time=0.5)


def test_narrower_limits_of_the_caller_stay(bad):
    script = f"""
import resource
from file_access.expansion import CannotExpand, expand, included_files
resource.setrlimit(resource.RLIMIT_AS, (400 << 20, 400 << 20))
try:
    expand({bad("${'a' * 5 * 10**8}")!r})
except CannotExpand as fault:
    print(fault)
"""
    assert "of memory" in python.run_python(script).stdout


@pytest.mark.slow
def test_ros_utils_and_the_environments_are_bounded(bad, short, capsys):
    assert ros_urdf.urdf_parse_from_path(bad(ENDLESS)) is None
    assert re.fullmatch(r"\[ERROR\] .*: does it compute without end\?\n", capsys.readouterr().err)
    path = bad(GREEDY)
    assert ros_urdf.urdf_load_from_path(path, "nix") is False
    assert not ros_gazebo.gazebo_spawn_urdf_path(path)
    assert re.fullmatch(r"(\[ERROR\] .*: needs more than .*\n){2}", capsys.readouterr().err)
    with pytest.raises(RobotEnvError, match="can't read .*: needs more than"):
        descriptions.read_urdf(path, {})


def test_the_files_that_one_includes(bad, tmp_path):
    (tmp_path / "part.xacro").write_text(XACRO.format("<link name='l'/>"))
    (tmp_path / "numbers.yaml").write_text("length: 1.0\n")
    text = '<xacro:arg name="p" default="part"/><xacro:include filename="$(arg p).xacro"/>'
    path = bad(f"{text}<link name=\"${{xacro.load_yaml('numbers.yaml')['length']}}\"/>")
    assert included_files(path) == [str(tmp_path / "numbers.yaml"), str(tmp_path / "part.xacro")]
    assert included_files(bad("<link name='l'/>")) == []
    with pytest.raises(CannotExpand, match="none.xacro"):
        included_files(bad('<xacro:include filename="none.xacro"/>'))


@pytest.mark.slow
def test_many_at_once(bad):
    """Each has its own state, which xacro keeps in module variables."""
    path = bad('<xacro:arg name="n" default=""/><link name="l$(arg n)"/>')
    texts = {}
    threads = [
        threading.Thread(target=lambda n=n: texts.update({n: expand(path, {"n": str(n)})})) for n in range(8)
    ]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert all(f'name="l{n}"' in text for n, text in texts.items())
    assert len(texts) == 8


def test_paths_modules_and_arguments_are_the_callers(tmp_path, monkeypatch):
    """Also with a blank, a quote and bytes that are no UTF-8."""
    folder = tmp_path / "a 'b' \udcff"
    folder.mkdir()
    (folder / "r.xacro").write_text(XACRO.format('<xacro:arg name="a" default=""/>$(arg a)'))
    monkeypatch.chdir(folder)
    assert "ä ${" in expand("r.xacro", {"a": "ä ${"}).replace("$$", "$")
    (tmp_path / "xacro.py").write_text("raise ImportError('the caller has another xacro')")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(CannotExpand, match="the caller has another xacro"):
        expand("r.xacro")


def test_python_that_cannot_be_started(bad, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nix")
    assert "can't be started: No such file" in refused(bad(""))


# --- the program, as roslaunch calls it ---------------------------------------------------------


def program(*arguments, **constants):
    limits = replace(LIMITS, **constants)
    start = "from file_access.limited import Limits; from file_access import expansion"
    script = f"{start}; expansion.LIMITS = {limits}; {PROGRAM}"
    return [sys.executable, "-c", script, *arguments]


def run(*arguments, **constants):
    return python.run(program(*arguments, **constants))


@pytest.mark.slow
def test_the_program_writes_what_the_function_returns(bad, tmp_path):
    path = bad('<xacro:arg name="n" default="1"/><link name="l$(arg n)"/>')
    done, out = run(path, "n:=7"), tmp_path / "new" / "out.urdf"
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == expand(path, {"n": "7"})
    assert run("-o", str(out), path, "n:=7").returncode == 0
    assert out.read_text() == done.stdout
    assert run("-o", str(out), bad("${1/0}")).returncode == 2
    assert out.read_text() == done.stdout
    assert run("--deps", bad(f'<xacro:include filename="{out}"/>')).stdout == str(out)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (ENDLESS, "1 s of processor time"),
        (GREEDY, "more than 1024 MiB"),
        (TWICE, "nested without end"),
        ("${1/0}", "division by zero"),
    ],
)
def test_the_program_ends_with_one_line(bad, text, reason):
    done = run(bad(text), processor_time=1)
    assert done.returncode == 2
    assert done.stdout == ""
    assert re.fullmatch(f"xacro: .*{reason}.*\n", done.stderr)


def test_the_program_keeps_its_usage_and_its_trace(bad):
    assert run().returncode == 2
    assert "Usage" in run("--help").stdout
    assert "Traceback" in run("--verbosity", "2", bad("${1/0}")).stderr


def test_a_reader_that_goes_away(bad):
    path = bad("<link/>" * 10**5)
    with subprocess.Popen(program(path), stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(60) == 128 + signal.SIGPIPE


def test_a_signal_ends_the_program_with_its_worker(tmp_path):
    os.mkfifo(tmp_path / "pipe.xacro")
    command = program(str(tmp_path / "pipe.xacro"))
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        with open(tmp_path / "pipe.xacro", "w"):  # opens when the worker reads
            process.terminate()
            assert process.stderr.read() == "xacro: ended by SIGTERM\n"  # both ends are closed
        assert process.wait(60) == expansion.BROKEN


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1", "windows-1252"])
@pytest.mark.parametrize("before", ["", "\r\n<!-- mine -->\r\n"])
def test_files_of_every_encoding(tmp_path, encoding, before):
    """Included ones as well; xacro by itself takes UTF-8 only."""
    declaration = f'{before}<?xml version="1.0" encoding="{encoding.removesuffix("-sig")}"?>\r\n'
    namespace = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    inner = f'{declaration}<robot {namespace}><link name="Gelenk für ${{1 + 1}}"/></robot>'
    outer = (
        f'{declaration}<robot name="Gerät" {namespace}><xacro:include filename="inner"/>'
        '<xacro:include filename="none" optional="true"/></robot>'
    )
    (tmp_path / "inner").write_bytes(inner.encode(encoding))
    (tmp_path / "outer").write_bytes(outer.encode(encoding))
    xml = expand(tmp_path / "outer")
    assert '<robot name="Gerät"' in xml
    assert '<link name="Gelenk für 2"/>' in xml
