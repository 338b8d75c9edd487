"""The catkin packages of the repository."""

from graphlib import TopologicalSorter
from pathlib import Path
from xml.etree import ElementTree

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
