"""Trials of a new package: a step of its environment, and whether its robot stands."""

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from package_writing import CannotWrite

SCRIPT = """
import dataclasses, importlib, json, sys, gymnasium
from robot_envs.testing import check_stands
package, env_id, *engines = sys.argv[1:]
env = gymnasium.make(env_id)
env.action_space.seed(0)
env.reset(seed=0)
env.step(env.action_space.sample())
made = importlib.import_module(f"{package}.robot")
for engine in engines:
    fault = ""
    try:
        check_stands(dataclasses.replace(made.ROBOT, engine=engine), made.STANCE)
    except AssertionError as error:
        fault = str(error)
    print(json.dumps([engine, fault]))
"""
FALLS = "it doesn't stand: "  # how check_stands begins
LIMIT = 300.0  # [s] of wall time, imports included
ENGINES = {"pybullet": "bullet", "mujoco": "mujoco"}  # by the module that each needs


def try_out(package: str, env_id: str, made: Path, *, stands: bool) -> dict[str, str]:
    """Takes a step in a package's environment, in a process of its own; not without ROS.

    With `stands` it also tries if the robot stands; returns why it doesn't, "" if it does, by each engine
    that is installed. Raises CannotWrite if the step fails.
    """
    if importlib.util.find_spec("rospkg") is None:  # without ROS nothing finds it by its name
        return {}
    there = [engine for module, engine in ENGINES.items() if importlib.util.find_spec(module)]
    paths = os.environ.get("ROS_PACKAGE_PATH", "")
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(made / "src"), *sys.path]),
        "ROS_PACKAGE_PATH": f"{made}:{paths}",
    }
    try:
        ended = subprocess.run(
            [sys.executable, "-B", "-c", SCRIPT, package, env_id, *(there if stands else ())],
            env=environment, timeout=LIMIT, capture_output=True, text=True, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise CannotWrite(f"the robot's first steps took more than {LIMIT:g} s") from error
    if ended.returncode:
        lines = ended.stderr.strip().splitlines() or [f"it ended with {ended.returncode}"]
        raise CannotWrite(f"the robot can't take a step: {lines[-1]}")
    return dict(map(json.loads, ended.stdout.splitlines()[-len(there) :] if stands else ()))


def stands_note(feet: Sequence[str], faults: Mapping[str, str]) -> str:
    """Returns a line on whether a robot stands on its feet, by what `try_out` found, and what to change."""
    names = ", ".join(feet)
    if not faults:
        return f"its feet: {names}; without ROS it wasn't tried whether it stands on them"
    wrong = [f"with {engine}, {fault.removeprefix(FALLS)}" for engine, fault in faults.items() if fault]
    if wrong:
        return (
            f"note: it doesn't stand on its feet ({names}): {'; '.join(wrong)}. Change STANCE in robot.py, "
            "the gains in config/controllers.yaml, or the URDF; test/test_environment.py tries it again"
        )
    return f"stands on its feet: {names} (tried for 5 s with {' and '.join(faults)})"
