"""The site's API reference: it has an entry for each public name that a page mentions."""

import ast
import importlib
import re
from pathlib import Path

import pytest

LIBRARIES = ("bullet_gazebo", "cartpole", "rl_workbench", "robot_envs", "robot_sim", "ros_calls", "ros_utils")
IMPORT = re.compile(rf"^ *from ((?:{'|'.join(LIBRARIES)})[\w.]*) import ([\w, ]+)$", re.MULTILINE)
NOT_FOR_USERS = ("docs/architecture.md",)
# Their classes are named by other names: controllers' types, ids of environments.
NAMED_OTHERWISE = ("bullet_gazebo.", "robot_sim.", "robot_envs.robots.", "cartpole.tasks")
SINGLE_WORDS = {"Reading", "Twist"}  # also words of ROS


@pytest.fixture(scope="module")
def entries(root):
    """Objects with an entry, by their names."""
    table = re.search(r"^API=\((.*?)^\)", (root / "tools/ws_docs.sh").read_text(), re.MULTILINE | re.DOTALL)
    found = {}
    for name in re.findall(r"[\w.]+", table[1]):
        parent, _, last = name.rpartition(".")
        try:
            module = importlib.import_module(name)
        except ModuleNotFoundError:
            found[last] = getattr(importlib.import_module(parent), last)
            continue
        names = getattr(module, "__all__", None) or [
            each for each, value in vars(module).items()
            if not each.startswith("_") and (each.isupper() or getattr(value, "__module__", "") == name)
        ]  # fmt: skip
        found |= {each: getattr(module, each) for each in names}
    return found


def pages(root):
    return [root / "README.md", *sorted((root / "docs").glob("*.md"))]


def test_what_pages_import_has_an_entry(root, entries):
    missing = [
        f"{page.name}: {module}.{name}"
        for page in pages(root)
        for module, names in IMPORT.findall(page.read_text())
        for name in re.split(r"\W+", names)
        if name and name not in entries
        and not (root / "src" / Path(*module.split("."), f"{name}.py")).exists()
    ]  # fmt: skip
    assert not missing


def test_each_class_that_a_page_names_has_an_entry(root, entries):
    classes = {
        node.name
        for path in (root / "src").rglob("*.py")
        if not ".".join(path.relative_to(root / "src").parts).startswith(NAMED_OTHERWISE)
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    }
    named = {
        (page.name, word)
        for page in pages(root)
        if str(page.relative_to(root)) not in NOT_FOR_USERS
        for text in re.findall(r"`([^`\n]+)`", page.read_text())
        for word in re.findall(r"\b[A-Z]\w+", text)
    }
    wanted = {"RobotWorld", "PluginContext", "launch_Gazebo", "CartPoleEnv"}
    missing = {each for each in named if each[1] in classes - SINGLE_WORDS - entries.keys()}
    assert not missing and wanted <= entries.keys()
