"""What rviz.launch can give another name is what its configuration shows."""

from pathlib import Path
from xml.etree import ElementTree

import yaml

ROOT = Path(__file__).resolve().parents[3]


def test_the_topics_of_sensors_are_arguments_of_the_launch():
    config = yaml.safe_load((ROOT / "rviz/sensors.rviz").read_text())
    displays = config["Visualization Manager"]["Displays"]
    shown = {each.get("Topic", each.get("Image Topic")) for each in displays} - {None}
    launch = ElementTree.parse(ROOT / "launch/rviz.launch")
    found = launch.findall("node[@name='rviz']/remap")
    remaps = {each.get("from"): each.get("to") for each in found}
    defaults = {f"$(arg {each.get('name')})": each.get("default") for each in launch.findall("arg")}
    assert {topic for topic in remaps if defaults.get(remaps[topic]) == topic} == shown
    assert len(shown) == 3
