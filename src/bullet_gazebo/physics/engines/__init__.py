"""Physics engines by the names that `physics:=` knows. Each is imported when it is asked for."""

import importlib.util
import os
import shlex
import sys

from bullet_gazebo.physics.engine import Engine

BULLET = ("ode", "bullet", "simbody", "dart")  # Gazebo's names: PyBullet stands in for all of them
MUJOCO = "mujoco"
ENGINES = (*BULLET, MUJOCO)


class EngineError(ValueError):
    """A physics engine that is not known, or not installed; the text says what to do."""


def make_engine(name: str = BULLET[0]) -> Engine:
    """Returns a new, empty engine.

    Raises:
        EngineError: if there is none of that name, or it isn't installed.
    """
    if name == MUJOCO:
        return _mujoco()
    if name not in ENGINES:
        raise EngineError(f"physics engine '{name}' is not known; there are {', '.join(ENGINES)}")
    from bullet_gazebo.physics.engines.bullet_engine import BulletEngine

    return BulletEngine()


def _installing() -> str:
    """The command that installs MuJoCo, for whoever reads it: `ws` says in CARTPOLE_WS where it is."""
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
