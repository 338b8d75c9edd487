"""save_state and restore_state: snapshots of a world in lock-step, kept under names (SaveState.srv)."""

import random
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
from bullet_gazebo_msgs.srv import (
    RestoreState,
    RestoreStateRequest,
    RestoreStateResponse,
    SaveState,
    SaveStateRequest,
    SaveStateResponse,
)

from bullet_gazebo.common.node_process import seed_random_numbers
from bullet_gazebo.services import ServiceRefused, offer
from bullet_gazebo.services.step_service import StepService
from file_access.text import did_you_mean
from robot_sim.generators import checked_bits
from robot_sim.simulator import Simulator
from robot_sim.snapshot import Snapshot, SnapshotError
from robot_sim.state_dict import StateError

MOST = 1000  # states; then the oldest one goes, since clients may end without forgetting theirs
LONGEST = 200  # characters of a name


class GlobalGenerators:
    """The generators of `random` and of NumPy's legacy functions, which plugins may use."""

    def state_dict(self) -> dict[str, Any]:
        version, words, gauss = random.getstate()
        python = version, np.array(words, np.uint32), gauss
        return {"python": python, "numpy": np.random.get_state(legacy=False)}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        version, words, gauss = state["python"]
        random.setstate((version, tuple(words.tolist()), gauss))
        np.random.set_state(dict(checked_bits(state["numpy"])))


def _check_name(name: str) -> None:
    if len(name) > LONGEST:
        raise ServiceRefused(f"a state's name has at most {LONGEST} characters, not {len(name)}")


class SnapshotServices:
    """The services; in lock-step only.

    Args:
        sim: The simulator.
        steps: Whose answers report contacts and measurements.
        one_at_a_time: See `StepService`.
    """

    def __init__(self, sim: Simulator, steps: StepService, one_at_a_time: threading.Lock) -> None:
        self._sim, self._one_at_a_time = sim, one_at_a_time
        sim.parts.update({"steps": steps, "random numbers": GlobalGenerators()})
        self._kept: dict[str, Snapshot] = {}
        self._services = [
            offer("~save_state", SaveState, self._save),
            offer("~restore_state", RestoreState, self._restore),
        ]

    def _save(self, request: SaveStateRequest) -> SaveStateResponse:
        _check_name(request.name)
        with self._one_at_a_time, self._sim.lock:
            for name in request.forget:
                self._kept.pop(name, None)
            done = "nothing saved, without a name"
            if request.name:
                self._sim.await_holds()
                try:
                    self._keep(request.name)
                except StateError as error:
                    raise ServiceRefused(str(error)) from error
                done = "state saved"
            read = self._find(request.read) if request.read else None
        try:
            data = b"" if read is None else read.to_bytes()
        except StateError as error:
            raise ServiceRefused(str(error)) from error
        return SaveStateResponse(True, f"SaveState: {done}", data)

    def _keep(self, name: str) -> None:
        state = self._sim.save_state()
        self._kept.pop(name, None)
        self._kept[name] = state
        if len(self._kept) > MOST:
            del self._kept[next(iter(self._kept))]

    def _find(self, name: str) -> Snapshot:
        if name not in self._kept:
            raise ServiceRefused(
                f"no state '{name:.{LONGEST}}' is kept{did_you_mean(name, self._kept)}; it was forgotten, "
                f"discarded as the oldest of {MOST}, or never saved in this simulator"
            )
        return self._kept[name]

    def _restore(self, request: RestoreStateRequest) -> RestoreStateResponse:
        _check_name(request.name)
        try:  # before it takes the lock: it may be long
            read = Snapshot.from_bytes(request.data) if request.data else None
        except SnapshotError as error:
            raise ServiceRefused(str(error)) from error
        with self._one_at_a_time, self._sim.lock:
            try:
                given = read or self._find(request.name)
                self._sim.await_holds()
                self._sim.restore_state(given)
                if read and request.name:  # without what the data had beyond a state
                    self._keep(request.name)
            except SnapshotError as error:
                raise ServiceRefused(str(error)) from error
            except StateError as error:
                return RestoreStateResponse(False, f"RestoreState: {error}", True)
            if request.seed:
                seed_random_numbers(request.seed)
                self._sim.reseed(request.seed)
        return RestoreStateResponse(True, "RestoreState: state restored", True)
