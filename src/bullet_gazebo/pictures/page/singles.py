"""Objects of a page that are one by one: the ground, files with looks of their own, names."""

from dataclasses import dataclass

import numpy as np
import viser

from bullet_gazebo.pictures.page.batches import compose


@dataclass
class _Single:
    number: int
    link: int
    inner: np.ndarray  # pose (7,) in the link
    node: viser.SceneNodeHandle


class Singles:
    """Objects of all models, by the models' numbers, as nodes below another one. For one thread."""

    def __init__(self, below: str) -> None:
        self._below, self._named = below, 0
        self._all: list[_Single] = []
        self._rows = np.zeros(0, dtype=int)

    def name(self) -> str:
        """Returns another name for each: one that was just taken away may go in the browser, too."""
        self._named += 1
        return f"{self._below}/single{self._named}"

    def add(self, number: int, link: int, inner: np.ndarray, node: viser.SceneNodeHandle) -> None:
        """Has a node follow a link of a model, at a pose (7,) in it."""
        self._all.append(_Single(number, link, inner, node))

    def remove(self, numbers: set[int]) -> None:
        """Takes away all of these models."""
        for each in self._all:
            if each.number in numbers:
                each.node.remove()
        self._all = [each for each in self._all if each.number not in numbers]

    def settle(self, first: dict[int, int]) -> None:
        """Tells at which row of the poses each model begins."""
        self._rows = np.array([first[each.number] + each.link for each in self._all], dtype=int)
        self._inner = np.array([each.inner for each in self._all]).reshape(-1, 7)

    def move(self, poses: np.ndarray, moved: np.ndarray) -> None:
        """Places the nodes by the poses (n, 7) of all links; `moved` (n,) are those that are others now."""
        due = np.flatnonzero(moved[self._rows])
        places = compose(poses[self._rows[due]], self._inner[due])
        for index, place in zip(due, places, strict=True):
            node = self._all[index].node
            node.position, node.wxyz = place[:3], place[[6, 3, 4, 5]]
