"""Poses in an SDF model: each given relative to some frame, all wanted relative to the model's."""

from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import numbers, shown
from bullet_gazebo.physics.pose import Pose, from_rpy

MODEL = "__model__"


def read_pose(parent: Element, where: str) -> tuple[Pose, str]:
    """Returns the `<pose>` of `parent` and the frame that it names ('' for the usual one)."""
    element = parent.find("pose")
    if element is None or not (element.text or "").strip():
        return Pose(), "" if element is None else element.get("relative_to", "")
    x, y, z, roll, pitch, yaw = numbers(element.text, f"{where}: <pose>", 6)
    return Pose((x, y, z), from_rpy(roll, pitch, yaw)), element.get("relative_to", "")


class Frames:
    """The named frames of one model: links, joints, nested models and `<frame>`s."""

    def __init__(self) -> None:
        self._given: dict[str, tuple[Pose, str]] = {}
        self._known: dict[str, Pose] = {MODEL: Pose()}

    def add(self, name: str, pose: Pose, relative_to: str) -> None:
        """Records that frame `name` is at `pose`, seen from `relative_to` (the model's if empty)."""
        self._given.setdefault(name, (pose, relative_to or MODEL))

    def resolve(self, name: str) -> Pose:
        """Returns frame `name` seen from the model's.

        Raises:
            DescriptionError: if unknown or circular.
        """
        chain: dict[str, Pose] = {}
        while name not in self._known:
            if name in chain:
                raise DescriptionError(
                    f"the frames {[shown(each) for each in list(chain)[:5]]} refer to each other in a circle"
                )
            if name not in self._given:
                raise DescriptionError(f"frame '{shown(name)}' does not exist")
            chain[name], name = self._given[name]
        pose = self._known[name]
        for inner, step in reversed(chain.items()):
            self._known[inner] = pose = pose.compose(step)
        return pose
