"""PyBullet comes without its line about when it was built, and without hiding what others write."""

import subprocess
import sys
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[4] / "src"
LIBRARY = SRC / "robot_sim/physics/engines/quiet_pybullet.py"
BESIDE = """
import os, sys, threading
sys.setswitchinterval(1e-6)
done = threading.Event()
count = 0
def write():
    global count
    while not done.is_set():
        os.write(2, b"%d\\n" % count)
        count += 1
thread = threading.Thread(target=write, daemon=True)
thread.start()
from robot_sim.physics.engines import make_engine
make_engine()
done.set()
thread.join()
print(count)
"""


def outcome(code: str, *python: str) -> subprocess.CompletedProcess[str]:
    command = [*python, sys.executable, "-c", f"import sys; sys.path = {sys.path}; {code}"]
    return subprocess.run(command, capture_output=True, text=True, check=True)


@pytest.mark.parametrize(
    "code",
    [
        "from robot_sim.physics.engines import make_engine; make_engine()",
        "import gymnasium, cartpole; gymnasium.make('cartpole/Balance-v0').reset(seed=0)",
        "import robot_envs.pictures.drawn",
    ],
)
def test_an_engine_comes_without_a_word(code: str) -> None:
    done = outcome(code)
    assert (done.stdout, done.stderr) == ("", "")


def test_what_another_thread_writes_meanwhile_comes_whole() -> None:
    done = outcome(f"exec({BESIDE!r})")
    lines = done.stderr.splitlines()
    assert sorted(map(int, lines)) == list(range(int(done.stdout)))


def test_what_c_writes_meanwhile_comes_afterwards(tmp_path: Path) -> None:
    (tmp_path / "pybullet.py").write_text("import ctypes; ctypes.CDLL(None).perror(b'of C')")
    code = f"sys.path.insert(0, {str(tmp_path)!r}); import robot_sim.physics.engines.quiet_pybullet"
    assert outcome(code).stderr.startswith("of C: ")


def test_a_library_that_cannot_be_loaded_says_why(tmp_path: Path) -> None:
    text = "import sys; print('a reason', file=sys.stderr); raise ImportError('broken')"
    (tmp_path / "pybullet.py").write_text(text)
    code = f"sys.path.insert(0, {str(tmp_path)!r}); import robot_sim.physics.engines.bullet_engine"
    with pytest.raises(subprocess.CalledProcessError) as caught:
        outcome(code)
    assert "a reason" in caught.value.stderr
    assert "ImportError: broken" in caught.value.stderr


def test_without_a_standard_error() -> None:
    code = "from robot_sim.physics.engines import make_engine; make_engine(); print('made')"
    assert outcome(code, "sh", "-c", 'exec "$@" 2>&-', "sh").stdout == "made\n"
