"""save_state and restore_state: snapshots of a world in lock-step, kept under names (SaveState.srv)."""

import random
import threading
from typing import Any, NamedTuple

import numpy as np
from bullet_gazebo_msgs.srv import RestoreState, RestoreStateRequest, SaveState, SaveStateRequest

from bullet_gazebo.services import ServiceRefused, offer
from bullet_gazebo.services.step_service import StepService
from file_access.text import did_you_mean
from robot_sim.physics.world import SnapshotError
from robot_sim.simulator import Simulator, Snapshot
from robot_sim.state_dict import StateError

MOST = 1000  # names


class KeptState(NamedTuple):
    """A snapshot, what the step service says of it, and the random numbers of the process."""

    snapshot: Snapshot
    steps: dict[str, Any]
    python: Any
    numpy: Any


class SnapshotServices:
    """The services; in lock-step only.

    Args:
        sim: the simulator.
        steps: whose answers report contacts and measurements.
        one_at_a_time: see `StepService`.
    """

    def __init__(self, sim: Simulator, steps: StepService, one_at_a_time: threading.Lock) -> None:
        self._sim, self._steps, self._one_at_a_time = sim, steps, one_at_a_time
        self._kept: dict[str, KeptState] = {}
        self._services = [
            offer("~save_state", SaveState, self._save),
            offer("~restore_state", RestoreState, self._restore),
        ]

    def _save(self, request: SaveStateRequest) -> str:
        with self._one_at_a_time, self._sim.lock:
            for name in request.forget:
                self._kept.pop(name, None)
            if not request.name:
                return "SaveState: nothing saved, without a name"
            if len(self._kept) >= MOST and request.name not in self._kept:
                raise ServiceRefused(
                    f"{MOST} states are kept already: name some that are to be forgotten"
                )
            self._sim.await_holds()
            try:
                snapshot = self._sim.save_state()
            except StateError as error:
                raise ServiceRefused(str(error)) from error
            self._kept[request.name] = KeptState(
                snapshot,
                self._steps.state_dict(),
                random.getstate(),
                np.random.get_state(legacy=False),
            )
        return "SaveState: state saved"

    def _restore(self, request: RestoreStateRequest) -> str:
        with self._one_at_a_time, self._sim.lock:
            kept = self._kept.get(request.name)
            if kept is None:
                raise ServiceRefused(
                    f"no state '{request.name}' is kept{did_you_mean(request.name, self._kept)}; it was "
                    "forgotten, or never saved in this simulator"
                )
            self._sim.await_holds()
            try:
                self._sim.restore_state(kept.snapshot)
            except (SnapshotError, StateError) as error:
                raise ServiceRefused(str(error)) from error
            self._steps.load_state_dict(kept.steps)
            random.setstate(kept.python)
            np.random.set_state(kept.numpy)
        return "RestoreState: state restored"
