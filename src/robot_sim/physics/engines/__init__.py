"""Physics engines by the names of `physics:=`. Each is imported when it is first used.

To add one: a module with subclasses of Engine and Body (../engine.py), its name in `ENGINES`, and its
import in `make_engine`. For environments it needs a backend, too: `BACKENDS` of robot_envs/backends and the
list of those with the same bits in robot_envs/testing/suite.py. The help of gzserver and empty_world.launch
name it.
"""

import importlib.util
import logging
import os
import platform
import shlex
import sys

from robot_sim.physics.engine import Engine

BULLET = ("ode", "bullet", "simbody", "dart")  # Gazebo's names: PyBullet stands in for all of them
MUJOCO = "mujoco"
ENGINES = (*BULLET, MUJOCO)

logger = logging.getLogger(f"rosout.{__name__}")


class EngineError(ValueError):
    """A physics engine is unknown or not installed; the text says what to do."""


def make_engine(name: str = BULLET[0]) -> Engine:
    """Returns a new, empty engine of one of `ENGINES`; MuJoCo, with a warning, where PyBullet can't be had.

    Raises EngineError if it is unknown or not installed.
    """
    if name not in ENGINES:
        raise EngineError(f"physics engine '{name}' is not known; there are {', '.join(ENGINES)}")
    if name in BULLET and importlib.util.find_spec("pybullet") is None:
        logger.warning(
            "There is no PyBullet for %s: MuJoCo is used, with other bits and without cameras",
            platform.machine(),
        )
        name = MUJOCO
    if name == MUJOCO:
        if importlib.util.find_spec("mujoco") is None:
            command = installing("mujoco")
            raise EngineError(f"physics engine 'mujoco' is not installed; '{command}' installs it")
        from robot_sim.physics.engines.mujoco_engine import MujocoEngine

        return MujocoEngine()
    from robot_sim.physics.engines.bullet_engine import BulletEngine

    return BulletEngine()


def installing(package: str) -> str:
    """Returns the command that installs a package of requirements/extras.txt."""
    workspace = os.environ.get("CARTPOLE_WS")  # the path of `ws`, which sets it
    pip = [sys.executable, "-m", "pip", "install", package]
    return shlex.join([workspace, "extras"] if workspace else pip)
