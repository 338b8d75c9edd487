"""A picture of the robot from its state alone: the same for every backend, and without a display."""

import math
from functools import lru_cache

import numpy as np

from cartpole.tasks import POSITION_LIMIT, CartPoleState

HEIGHT, WIDTH = 320, 640  # [pixels]
SCALE = 280.0  # [pixels/m]
MIDDLE, HINGE = WIDTH / 2, HEIGHT / 2  # [pixels]; where x = 0 is, and the hinge's height
POLE_LENGTH, POLE_RADIUS = 0.5, 0.01  # [m], as in the URDF
CART_LENGTH, CART_DEPTH = 0.09, 0.03
RAIL_LENGTH, RAIL_DEPTH = 1.16, 0.02
WHITE, GREY, BLUE, ORANGE, RED = (
    (255, 255, 255), (140, 145, 153), (31, 89, 166), (237, 128, 26), (200, 40, 40),
)  # fmt: skip


def draw(state: CartPoleState) -> np.ndarray:
    """Returns the robot seen from the side, x to the right: (320, 640, 3) of uint8."""
    picture = _scenery().copy()
    x = MIDDLE + SCALE * max(-2.0, min(2.0, state.cart_position))
    _box(picture, x, HINGE + SCALE * CART_DEPTH / 2, CART_LENGTH, CART_DEPTH, BLUE)
    reach = SCALE * POLE_LENGTH
    tip = (x - reach * math.sin(state.pole_angle), HINGE - reach * math.cos(state.pole_angle))
    _rod(picture, (x, HINGE), tip, SCALE * POLE_RADIUS, ORANGE)
    return picture


@lru_cache(maxsize=1)
def _scenery() -> np.ndarray:
    """What doesn't move: the rail, and marks where episodes end."""
    picture = np.full((HEIGHT, WIDTH, 3), WHITE, dtype=np.uint8)
    top = HINGE + SCALE * CART_DEPTH
    _box(picture, MIDDLE, top + SCALE * RAIL_DEPTH / 2, RAIL_LENGTH, RAIL_DEPTH, GREY)
    for side in (-1, 1):
        mark = MIDDLE + side * SCALE * POSITION_LIMIT
        _box(picture, mark, top + SCALE * RAIL_DEPTH / 2, 0.01, RAIL_DEPTH, RED)
    return picture


def _box(
    picture: np.ndarray, x: float, y: float, width: float, height: float, colour: tuple[int, ...]
) -> None:
    """Fills a box around (x, y) [pixels] of width and height [m]."""
    across, down = SCALE * width / 2, SCALE * height / 2
    left, top = max(0, round(x - across)), max(0, round(y - down))
    picture[top : max(0, round(y + down)), left : max(0, round(x + across))] = colour


def _rod(
    picture: np.ndarray,
    begin: tuple[float, float],
    end: tuple[float, float],
    radius: float,
    colour: tuple[int, ...],
) -> None:
    """Draws a line with round ends, smooth at its edges; all in [pixels]."""
    (x0, y0), (x1, y1) = begin, end
    margin = radius + 1.0
    left, top = (max(0, math.floor(min(a, b) - margin)) for a, b in ((x0, x1), (y0, y1)))
    part = picture[top : math.ceil(max(y0, y1) + margin), left : math.ceil(max(x0, x1) + margin)]
    rows, columns = np.ogrid[: part.shape[0], : part.shape[1]]
    x, y = columns + (left - x0 + 0.5), rows + (top - y0 + 0.5)
    dx, dy = x1 - x0, y1 - y0
    along = np.clip((x * dx + y * dy) / (dx * dx + dy * dy), 0.0, 1.0)
    distance = np.hypot(x - along * dx, y - along * dy)
    cover = np.clip(radius + 0.5 - distance, 0.0, 1.0)[..., np.newaxis]
    part[:] = np.rint(part + cover * (np.array(colour) - part)).astype(np.uint8)
