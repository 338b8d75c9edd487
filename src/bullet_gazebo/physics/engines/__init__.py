"""Physics engines by the names of `physics:=`. Each is imported when it is first used.

To add one: a module with subclasses of Engine and Body (../engine.py), and its name in `make_engine`.
"""

import importlib.util
import os
import shlex
import sys

from bullet_gazebo.physics.engine import Engine

BULLET = ("ode", "bullet", "simbody", "dart")  # Gazebo's names: PyBullet stands in for all of them
MUJOCO = "mujoco"
ENGINES = (*BULLET, MUJOCO)


class EngineError(ValueError):
    """A physics engine is unknown or not installed; the text says what to do."""


def make_engine(name: str = BULLET[0]) -> Engine:
    """Returns a new, empty engine.

    Raises:
        EngineError: if it is unknown or not installed.
    """
    if name == MUJOCO:
        return _mujoco()
    if name not in ENGINES:
        raise EngineError(f"physics engine '{name}' is not known; there are {', '.join(ENGINES)}")
    from bullet_gazebo.physics.engines.bullet_engine import BulletEngine

    return BulletEngine()


def _installing() -> str:
    """Returns the command that installs MuJoCo. `ws` sets CARTPOLE_WS to its own path."""
    workspace = os.environ.get("CARTPOLE_WS")
    command = (
        [workspace, "extras"] if workspace else [sys.executable, "-m", "pip", "install", "mujoco"]
    )
    return shlex.join(command)


def _mujoco() -> Engine:
    if importlib.util.find_spec("mujoco") is None:
        raise EngineError(
            f"physics engine 'mujoco' is not installed; '{_installing()}' installs it"
        )
    from bullet_gazebo.physics.engines.mujoco_engine import MujocoEngine

    return MujocoEngine()
