"""What the import of a part brings along: seconds for whoever starts it, and packages that may be missing."""

import subprocess
import sys
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[3] / "src"
LEARNING = ("gymnasium", "torch", "stable_baselines3", "matplotlib")
ROS = ("rospy", "rosgraph", "roslib", "genpy")


def modules(package):
    """The names of all modules of a package."""
    paths = sorted((SRC / package.replace(".", "/")).rglob("*.py"))
    names = [".".join(path.relative_to(SRC).with_suffix("").parts) for path in paths]
    return [name.removesuffix(".__init__") for name in names]


def loaded_by(names):
    """The top-level packages that a fresh Python has after importing modules."""
    code = f"import sys, {', '.join(names)}\nprint(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return {name.partition(".")[0] for name in run.stdout.split()}


@pytest.mark.parametrize(
    ("names", "absent"),
    [
        pytest.param(["bullet_gazebo.ros.node.gzserver"], LEARNING, id="gzserver"),
        pytest.param(["bullet_gazebo.ros.clients.gz"], ("rospy", *LEARNING), id="gz"),
        pytest.param(
            [
                "bullet_gazebo.simulator",
                "bullet_gazebo.robot",
                *modules("bullet_gazebo.physics"),
                *modules("bullet_gazebo.control"),
            ],
            (*ROS, *LEARNING),
            id="in-process",
        ),
    ],
)
def test_an_import_leaves_out(names, absent):
    loaded = loaded_by(names)
    assert "bullet_gazebo" in loaded
    assert loaded.isdisjoint(absent)
