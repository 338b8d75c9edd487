"""Episodes in 3-D: one HTML file that plays them in any browser, made by viser.

For environments that can draw themselves on a page of viser's, by a method `draw_on` (`robot_envs`).
"""

from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import gymnasium

from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import write_file
from rl_workbench.tools.pictures.filming import Player, Recorded, Shot, frame_rate, shots
from rl_workbench.training.environments import shares_robot
from viewer.server import hidden_page

DRAW = "draw_on"  # method of an environment
END = 1.0  # [s] for which the end is seen, before it begins anew


def is_scene(env: gymnasium.Env[Any, Any]) -> bool:
    """Whether an environment can be recorded in 3-D."""
    return hasattr(env.unwrapped, DRAW)


def record_scene(
    path: Path,
    players: Sequence[Player],
    seed: int,
    fastest: float,
    *,
    longest: int = 0,
    captions: bool = True,
) -> Recorded:
    """Plays an episode of each, all at once and beside each other, and writes the file.

    Args:
        seed: of the episodes.
        fastest: frames a second at most [Hz].
        longest: number of steps after which an episode is cut off; 0: never.
        captions: tell step, return and action below the robots.

    Raises:
        WorkbenchError: if the robot can't be drawn, or the players share one robot.
    """
    if len(players) > 1 and shares_robot(players[0].env):
        raise WorkbenchError("there is one robot only: record its episodes one by one")
    with hidden_page() as server:
        try:
            robots = [
                getattr(player.env.unwrapped, DRAW)(server, number)
                for number, player in enumerate(players)
            ]
            recording = server.get_scene_serializer()
            rate, stride = frame_rate(players[0].env, fastest)
            episodes = [shots(player, seed, stride, longest) for player in players]
            ends: dict[int, Shot] = {}
            frames = 0
            for moment in zip_longest(*episodes):  # one that is over stays as it is
                if frames:
                    recording.insert_sleep(1.0 / rate)
                frames += 1
                for number, shot in enumerate(moment):
                    if shot is not None:
                        robots[number](shot.caption if captions else "")
                        ends[number] = shot
        except gymnasium.error.Error as error:
            raise WorkbenchError(f"the environment can't be drawn: {error}") from error
        recording.insert_sleep(END)
        page = recording.as_html()
    write_file(path, lambda stream: stream.write(page.encode()))
    return Recorded([ends[number] for number in sorted(ends)], frames, frames / rate)
