"""The script: compilation, execution as `__main__`, seeds, and the frames that are its own."""

import ast
import builtins
import importlib.abc
import importlib.machinery
import importlib.util
import os
import random
import re
import sys
import sysconfig
import threading
import tokenize
import types
from collections.abc import Callable, Sequence
from typing import Any

# Python 3's complaints about what only Python 2 allowed.
PYTHON_2 = re.compile(
    "call to '(print|exec)'|multiple exception types|leading zeros|inconsistent use of tabs"
)
OURS = __name__.partition(".")[0]
ADDRESS = "LOCKSTEP_CLOCK"  # environment variable: path of the script process's socket


class NoScript(Exception):
    """The file can't be run; the text says why."""


def compiled(path: str) -> types.CodeType:
    """Returns a script's code; raises NoScript if the file can't be read, or isn't Python 3."""
    try:
        with tokenize.open(path) as file:
            source = file.read()
        return compile(ast.parse(source, path), path, "exec", dont_inherit=True)
    except (OSError, UnicodeDecodeError) as fault:
        raise NoScript(f"{path}: {fault}") from fault
    except (SyntaxError, ValueError) as fault:
        what, place = str(fault), ""
        if isinstance(fault, SyntaxError):
            what, place = fault.msg, f", line {fault.lineno}"
        hint = " (a script for Python 2? 2to3 mends most of it)" if PYTHON_2.search(what) else ""
        raise NoScript(f"{path}{place}: {what}{hint}") from fault


def run(path: str, arguments: Sequence[str], code: types.CodeType) -> None:
    """Runs a script as `__main__` in the current folder; its exceptions pass through, see `own_part`."""
    main = types.ModuleType("__main__")
    main.__dict__.update(__file__=path, __builtins__=builtins, __cached__=None)
    sys.modules["__main__"] = main
    sys.argv = [path, *arguments]
    sys.path[0] = os.path.dirname(os.path.realpath(path))
    exec(code, main.__dict__)


def own_part(trace: types.TracebackType | None, path: str) -> types.TracebackType | None:
    """Returns a traceback from the script's first frame on, without the frames of replaced functions."""
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


def seed_everything(seed: int) -> None:
    """Seeds random and NumPy now, and torch when the script imports it."""
    import numpy

    random.seed(seed)
    numpy.random.seed(seed)
    # The entropy of generators without a seed, such as those of Gymnasium environments
    vars(numpy.random.bit_generator)["randbits"] = random.Random(seed).getrandbits
    if "torch" in sys.modules:
        sys.modules["torch"].manual_seed(seed)
    else:
        sys.meta_path.insert(0, AfterImport("torch", lambda torch: torch.manual_seed(seed)))


class AfterImport(importlib.abc.MetaPathFinder):
    """Calls a function with a module once it has been imported."""

    def __init__(self, name: str, call: Callable[[types.ModuleType], object]) -> None:
        self._name = name
        self._call = call

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: types.ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._name:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def executing(module: types.ModuleType) -> None:
            execute(module)
            self._call(module)

        spec.loader.exec_module = executing  # type: ignore[method-assign]
        return spec


STANDARD = sysconfig.get_path("stdlib") + "/"
# They wait for their own processes, sockets, files and threads: such waits stay wall time, as do those of
# a package that says so itself, by WALL_TIME.
LIBRARIES = frozenset(
    ["catkin_pkg", "file_access", "genpy", "joblib", "lockstep_runner", "matplotlib",
     "multiprocess", "numpy", "optuna", "psutil", "pybullet", "ray", "ros_calls", "ros_utils", "rosgraph",
     "roslaunch", "roslib", "rosmaster", "rosnode", "rosparam", "rospkg", "rospy", "rosservice", "rostopic",
     "scipy", "tensorboard", "tensorboardX", "tensorflow", "torch", "tqdm", "wandb", "xacro", "xmlrpc"]
)  # fmt: skip
WALL_TIME = "__wall_time__"


# A wait in these counts as their caller's.
GO_BETWEENS = frozenset(["threading", "queue", "concurrent.futures._base", "concurrent.futures.thread"])


class SubmittedCall:
    """A function that the script gave to an executor."""

    def __init__(self, call: Callable[..., Any]) -> None:
        self._call = call

    def __call__(self, *args: Any, **kwds: Any) -> Any:
        return self._call(*args, **kwds)


def is_the_script(depth: int) -> bool:
    """Returns whether the function `depth` frames above the caller is the script's or its modules'.

    A wait in Python's own `queue`, `threading` and `concurrent.futures` counts as their caller's, one in
    a `threading.Timer` or `SubmittedCall` as the script's.
    """
    frame: types.FrameType | None = sys._getframe(depth + 1)
    while frame is not None and frame.f_code not in BEGIN_OF_THREADS:
        if _module(frame) not in GO_BETWEENS:
            return _is_a_script(frame)
        frame = frame.f_back
    return frame is not None


BEGIN_OF_THREADS = (threading.Timer.run.__code__, SubmittedCall.__call__.__code__)


def _is_a_script(frame: types.FrameType) -> bool:
    path = frame.f_code.co_filename
    if path.startswith("<frozen"):
        return False
    if path.startswith(STANDARD) and "-packages/" not in path:
        return False
    package = _package(frame)
    return package not in LIBRARIES and WALL_TIME not in vars(sys.modules.get(package, builtins))


def caller(depth: int) -> str:
    """Returns the top-level package or module of the function `depth` frames above the caller."""
    return _package(sys._getframe(depth + 1))


def _module(frame: types.FrameType) -> str:
    name: str = frame.f_globals.get("__name__", "")
    return name


def _package(frame: types.FrameType) -> str:
    return _module(frame).partition(".")[0]
