"""The page of a run: an episode, and the curves of its training."""

import contextlib
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import viser

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.viewing.player import Player
from rl_workbench.tools.viewing.recorder import Recorder
from rl_workbench.tools.viewing.views import CAMERA, LOOK_AT
from rl_workbench.training.progress import tell, warn
from viewer.address import PortInUse, find_address
from viewer.curves import Curves
from viewer.server import open_browser, serve, stop

PERIOD = 1.0 / 30.0  # [s] of the player's pictures
CURVES = 1.0  # [s] between two looks at the table
UNSEEN = 0.25  # [s] between two looks whether somebody has come
PATIENCE = 10.0  # [s] for an episode to be given up at the end
SHOWING, POWER = "the run", "plays its episodes"


class Wanted(NamedTuple):
    """What is to be shown."""

    folder: Path
    policies: tuple[str, ...]  # the first one is played
    seed: int = 0
    episodes: int = 1
    env_options: dict[str, Any] = {}


class Place(NamedTuple):
    """Where the page is to be served."""

    host: str
    port: int | None
    browser: bool


def show_run(
    wanted: Wanted,
    place: Place,
    is_over: Callable[[], bool],
    told: Callable[[], None] = lambda: None,
) -> None:
    """Serves the page until it is over.

    Args:
        told: is called once the address was told.

    Raises:
        WorkbenchError: if the page can't be served there.
    """
    try:
        address = find_address(place.host, place.port)
        server = serve(address, wanted.folder.name, CAMERA, LOOK_AT)
    except PortInUse as error:
        raise WorkbenchError(str(error)) from error
    with contextlib.ExitStack() as ending:
        ending.callback(stop, server)
        for line in address.advice(SHOWING, POWER):
            tell(line)
        told()
        if place.browser:  # which may stay until its user leaves it
            threading.Thread(target=open_browser, args=(address, warn), daemon=True).start()
        _show(server, wanted, is_over)


def _show(server: viser.ViserServer, wanted: Wanted, is_over: Callable[[], bool]) -> None:
    while not server.get_clients():  # nothing is played for nobody
        if is_over():
            return
        time.sleep(UNSEEN)
    recorder = Recorder(wanted.folder, server, wanted.env_options)
    ended = threading.Event()
    try:
        with server.gui.add_folder("Episode"):
            player = Player(server.gui, recorder, wanted.policies, wanted.seed, wanted.episodes)
        curves = Curves(server.gui, server.gui.add_folder("Training"))
        curves.follow(wanted.folder)
        threading.Thread(target=_draw, args=(server, curves, ended), daemon=True).start()
        _play(server, player, is_over)
    finally:
        ended.set()
        recorder.close(PATIENCE)


def _play(server: viser.ViserServer, player: Player, is_over: Callable[[], bool]) -> None:
    last = time.monotonic()
    while not is_over():
        is_watched = bool(server.get_clients())
        time.sleep(PERIOD if is_watched else UNSEEN)
        now = time.monotonic()
        if is_watched:
            player.tick(min(now - last, UNSEEN))
        last = now


def _draw(server: viser.ViserServer, curves: Curves, ended: threading.Event) -> None:
    is_behind = True
    while not ended.wait(0.0 if is_behind else CURVES):
        is_behind = bool(server.get_clients()) and curves.update()
