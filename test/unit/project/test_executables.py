"""The executables of launch files when there is no master to talk to."""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from support.python import run

pytestmark = pytest.mark.slow

BOUND = 60.0  # [s]
SCRIPTS = Path(__file__).parents[3] / "scripts"
MAIN = "import sys; from bullet_gazebo.{} import {} as main; sys.exit(main())"
PROGRAMS = {  # module and function: arguments, exit code after Ctrl-C
    "clients.spawner main": (["a_controller"], 0),
    "clients.spawner unspawner_main": (["a_controller"], 0),
    "clients.spawn_model main": (["-urdf", "-file", "/dev/null", "-model", "m", "-b"], 1),
    "clients.gzclient main": ([], 0),
    "node.gzserver main_with_window": ([], 130),
}


@pytest.fixture
def start(tmp_path):
    """Starts a program whose master is at a port; ends it at the end."""
    programs = []

    def start(name, port):
        arguments, _ = PROGRAMS[name]
        master = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
        environment = os.environ | master | dict.fromkeys(("ROS_HOME", "ROS_LOG_DIR"), str(tmp_path))
        program = subprocess.Popen(
            [sys.executable, "-c", MAIN.format(*name.split()), *arguments],
            env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        programs.append(program)
        return program

    yield start
    for program in programs:
        program.kill()
        program.communicate()


@pytest.mark.parametrize(
    ("name", "number"),
    [*((name, signal.SIGINT) for name in PROGRAMS), ("node.gzserver main_with_window", signal.SIGTERM)],
)
def test_a_signal_in_the_middle_of_a_registration_ends_it(start, name, number):
    with socket.create_server(("127.0.0.1", 0)) as mute_master:
        mute_master.settimeout(BOUND)
        program = start(name, mute_master.getsockname()[1])
        with mute_master.accept()[0]:
            program.send_signal(number)
            output, _ = program.communicate(timeout=BOUND)
    assert program.returncode == PROGRAMS[name][1]
    assert "Traceback" not in output


@pytest.mark.parametrize("name", ["clients.spawner main", "node.gzserver main_with_window"])
def test_without_a_master_it_says_so_until_it_is_interrupted(start, name):
    with socket.socket() as reserved:  # bound, and nobody listens: connections are refused
        reserved.bind(("127.0.0.1", 0))
        program = start(name, reserved.getsockname()[1])
        for line in program.stdout:
            if "no ROS master at" in line:
                break
        program.send_signal(signal.SIGINT)
        output, _ = program.communicate(timeout=BOUND)
    assert program.returncode == PROGRAMS[name][1]
    assert "Traceback" not in output


@pytest.mark.parametrize("name", ["shown_joints.py", "spawn_robot.py"])
def test_help_ends_at_once(name):
    told = run([sys.executable, SCRIPTS / name, "--help"], check=True)
    assert told.stdout.startswith(f"usage: {name}")
