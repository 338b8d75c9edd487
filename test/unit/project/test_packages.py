"""The catkin packages of the repository."""

import re
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path
from xml.etree import ElementTree

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[3]


def test_no_package_depends_on_itself_through_others():
    """rospack, roswtf and catkin refuse such a circle, in users' packages too."""
    depends = {}
    for path in (ROOT / "package.xml", *ROOT.glob("companions/*/package.xml")):
        package = ElementTree.parse(path).getroot()
        found = {(each.text or "").strip() for each in package if each.tag.endswith("depend")}
        depends[package.findtext("name")] = found
    assert len(depends) > 10
    TopologicalSorter(depends).prepare()  # raises CycleError


# What rosdep calls them, where that isn't their name.
KEYS = {
    "pillow": "pil", "pybullet-arm64": "pybullet", "pycollada": "collada", "pygame-ce": "pygame",
    "pyyaml": "yaml", "torch": "pytorch",
}  # fmt: skip


def test_catkin_and_pip_need_the_same_python_packages():
    """What pyproject.toml lists is a key of package.xml, or is named there as one without a key."""
    text = (ROOT / "package.xml").read_text()
    keys = set(re.findall(r">python3-([\w-]+?)(?:-pip)?</exec_depend>", text))
    (listed,) = re.findall(r"from pip alone: (.*)\. -->", text)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    needed = {Requirement(each).name for each in project["dependencies"]} - {"xacro"}  # of ROS
    alone = set(re.findall(r"[\w-]+", re.sub(r"\(.*?\)", "", listed)))
    assert {KEYS.get(name, name) for name in needed} == keys | alone
