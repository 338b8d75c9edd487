"""The text of a model, before it is parsed; what the log says about it."""

import pytest
import rospy

from bullet_gazebo.services import spawn_services
from bullet_gazebo.services.spawn_services import without_comments
from robot_sim.physics.files.sdf import parse_sdf


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("<?xml version='1.0'?><robot/>", "<robot/>"),
        ("<!-- <sdf> --><robot><!--\n--> </robot>", "<robot> </robot>"),
        ("<robot/><!-- open", "<robot/><!-- open"),  # XML refuses it
        ("<!-- a --><robot/><!-- open <!-- twice", "<robot/><!-- open <!-- twice"),
        ("<?xml <robot/>", "<?xml <robot/>"),
    ],
)
def test_the_declaration_and_whole_comments_go(text: str, left: str) -> None:
    assert without_comments(text) == left


def test_the_log_names_each_thing_once(monkeypatch) -> None:
    logged: list[str] = []
    monkeypatch.setattr(rospy, "logwarn", lambda text, *args: logged.append(text % args))
    table = '<sdf version="1.6"><model name="t">{}<include><uri>model://table</uri></include></model></sdf>'
    model = parse_sdf(table.format("<static>1</static>"))
    model.left_out += ["plugin a.so", "plugin b.so", "plugin a.so", "plugin a.so"]
    model.warnings += ["a hole", "a hole"]
    spawn_services._tell_stand_in.cache_clear()
    for _ in range(2):
        spawn_services._log("Model 't'", model)
    assert logged[:3] == [
        "Model 't': a hole (2 times)",
        "model://table is not installed: a simple shape of its size and mass stands in for it",
        "Model 't': not simulated here, so left out: plugin a.so (3 times), plugin b.so",
    ]
    assert logged[3:] == [logged[0], logged[2]]
