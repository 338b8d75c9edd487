"""The text of a model, before it is parsed."""

import pytest

from bullet_gazebo.ros.services.spawn_services import without_comments


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
