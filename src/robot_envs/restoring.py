"""Episodes of environments, saved and restored."""

import contextlib
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import gymnasium

from file_access.text import one_line
from robot_envs.errors import RestoreRefused, SimulatorError
from robot_envs.pictures.drawn import DrawnEnv
from robot_envs.snapshot import EnvSnapshot
from robot_envs.variation import Randomisation, Variation
from robot_envs.variation.imperfections import Actuator, Sensor
from robot_envs.world_state import Joints, WorldState
from robot_sim.fingerprint import digest
from robot_sim.generators import KIND
from robot_sim.physics.engine import STRONGEST
from robot_sim.plain_data import is_within, misfit, resolve
from robot_sim.snapshot import SnapshotError
from robot_sim.state_dict import StateError, is_supplied, load, module_of, state_of, undoable


def _bounds(space: gymnasium.Space[Any]) -> str:
    """Returns what tells spaces apart; their own texts depend on NumPy's print options."""
    inner = getattr(space, "spaces", ())
    named = inner.items() if isinstance(inner, Mapping) else enumerate(inner)
    own = [getattr(space, name, None) for name in ("low", "high", "n", "start", "nvec")]
    kept = str(space.dtype), own, [(key, _bounds(each)) for key, each in named]
    return f"{type(space).__name__}{space.shape or ''} {digest(kept)}"


class SavedEnv(DrawnEnv):
    """An environment whose episode can be saved and restored."""

    control_period: float  # [s]
    _sensor: Sensor | None
    _actuator: Actuator | None
    _randomisation: Randomisation | None
    _variation: Variation
    _first: dict[str, Any]  # commands that go along with an episode's first action
    _steps: int | None  # None: no episode is under way
    _closed: bool
    _begun: Any  # the step that is under way

    def save_state(self) -> EnvSnapshot:
        """Returns everything that decides the future of world, episode, task and generators.

        Raises:
            gymnasium.error.ResetNeeded: Before the first episode.
            SimulatorError: If the task holds something unreadable, or the world runs in real time.
        """
        self._check_open()
        if self._state is None or self._begun is not None:
            raise gymnasium.error.ResetNeeded("a snapshot is taken after a reset() or a step()")
        try:
            parts = {name: state_of(part) for name, part in self._parts().items()}
        except StateError as error:
            raise SimulatorError(str(error)) from error
        own = parts["task"] if isinstance(parts["task"], dict) else ()
        state = {
            "variation": self._variation, "state": self._state, "first": self._first,
            "initial": self._initial, "steps": self._steps, "parts": parts,
            "lent": [name for name in own if getattr(self.task, name, None) is self._np_random],
        }  # fmt: skip
        return EnvSnapshot(self._fits, state, self.backend.save_state())

    def restore_state(self, snapshot: EnvSnapshot) -> None:
        """Returns to a snapshot of an environment like this: the same actions lead to the same bits.

        Raises:
            ValueError: If it is of an environment with another task, control period, or noise.
            SimulatorError: If the world isn't that of the snapshot. Then nothing has changed.
        """
        self.check_fits(snapshot)
        is_foreign = snapshot.is_foreign
        if not is_foreign and not self._differs(snapshot.state["variation"]):
            self._load(snapshot)
            return
        before = None
        with contextlib.suppress(SimulatorError, gymnasium.error.ResetNeeded):  # without an episode
            before = self.save_state()
        try:
            if is_foreign:
                state = resolve(snapshot.state)
                self._check(state, before)
                snapshot = EnvSnapshot(snapshot.fits, state, snapshot.world)
            with undoable() if is_foreign else contextlib.nullcontext():
                self._load(snapshot)
        except BaseException as error:  # whatever a forged state leads to, and Ctrl-C
            # A live one may be restored but for a user's class.
            is_left = isinstance(error, RestoreRefused if is_foreign else SimulatorError)
            if before is not None and not (is_left and self._steps is not None):
                with contextlib.suppress(SimulatorError):  # a reset comes next
                    self._load(before)
            if isinstance(error, SimulatorError) or not isinstance(error, Exception):
                raise
            raise SimulatorError(one_line(f"the snapshot can't be restored: {error!s:.300}")) from error

    def check_fits(self, snapshot: EnvSnapshot) -> None:
        """Raises ValueError if it is of an environment with another task, control period, or noise."""
        self._check_open()
        if not isinstance(snapshot, EnvSnapshot):
            raise ValueError(f"it isn't a snapshot of an environment: {snapshot!r:.100}")
        here, given = self._fits, snapshot.fits
        if given != here:
            name = next((name for name in here if given.get(name) != here[name]), "description")
            raise ValueError(
                f"the snapshot is of another environment: its {name} is {given.get(name)!r:.100}, not "
                f"{here.get(name)!r}"
            )

    def _check(self, state: dict[str, Any], before: EnvSnapshot | None) -> None:
        """Checks a foreign state, but for attributes of a user's classes: they may be of any type."""
        there = {
            "state": WorldState(0.0, Joints()), "first": {}, "steps": 0, "parts": {}, "lent": [],
            "variation": self._variation, "initial": self._initial, **(before.state if before else {}),
        }  # fmt: skip
        parts = self._parts().items()
        there["parts"] = {name: state_of(each) for name, each in parts if is_supplied(type(each))}
        if fault := misfit(there, state):
            raise SnapshotError(fault)
        own, given = there["parts"].get("task", {}), state["parts"].get("task", {})
        if lost := [name for name in own if name not in given]:
            raise SnapshotError(f"the task lacks {lost[0]}")
        if any(KIND not in given.get(name, ()) for name in state["lent"]):
            raise SnapshotError(f"the task has no generators {state['lent']!r:.200}")
        if (state["steps"] or 0) < 0:
            raise SnapshotError(f"steps is {state['steps']}")
        self._check_beginning(state)

    def _check_beginning(self, state: dict[str, Any]) -> None:
        varied = vars(state["variation"])
        if missing := [name for name, each in varied.items() if each is None and name != "gravity"]:
            raise SnapshotError(f"the variation lacks {missing[0]}")
        if not is_within(varied, STRONGEST):
            raise SnapshotError("a number of the variation is too large, or NaN")
        self.scene.commands(state["first"])

    def _load(self, snapshot: EnvSnapshot) -> None:
        state, variation = snapshot.state, self._variation
        is_varied = self._differs(state["variation"])
        steps = None if is_varied or self._begun else self._steps
        self._steps = self._begun = None
        if is_varied:
            self._vary(state["variation"])
        try:
            fault = self.backend.restore_state(snapshot.world)  # of a class; all else is restored
        except RestoreRefused:
            if is_varied:
                self._vary(variation)
            self._steps = steps
            raise
        self._state, self._first, self._initial = state["state"], state["first"], state["initial"]
        parts = state["parts"]
        try:
            load((part, parts[name]) for name, part in self._parts().items())
        except StateError as error:
            fault = str(error)
        for name in state["lent"]:
            if name in parts["task"]:
                setattr(self.task, name, self.np_random)
        self._steps = state["steps"]  # last: what Ctrl-C has left half restored needs a reset
        self._show()
        if fault:
            raise SimulatorError(fault)

    def _begin_at(self, snapshot: EnvSnapshot, seed: int) -> WorldState:
        """Begins an episode in the snapshot's world; task, noise and random numbers are this one's own."""
        here = {"variation": self._variation, "first": self._first, "initial": self._initial}
        try:
            given = resolve({name: snapshot.state[name] for name in here})
            if fault := misfit(here, given):
                raise SnapshotError(fault)
            self._check_beginning(given)
            if self._differs(given["variation"]):
                self._vary(given["variation"])
            begun = self.backend.begin_at(snapshot.world, seed)
            self._first, self._initial = given["first"], given["initial"]
            return begun
        except SimulatorError:
            raise
        except Exception as error:  # whatever a forged state leads to
            raise SimulatorError(one_line(f"no episode can begin at the snapshot: {error!s:.300}")) from error

    def _parts(self) -> dict[str, Any]:
        """Returns everything with a state, except the world, by name."""
        parts = {
            "generator": self.np_random, "sensor": self._sensor, "actuator": self._actuator,
            "task": self.task, "randomisation": self._randomisation,
        }  # fmt: skip
        return {name: part for name, part in parts.items() if part is not None}

    @cached_property
    def _fits(self) -> dict[str, Any]:
        """What another environment must share to restore its snapshots."""
        kind, spaces = type(self.task), (self.observation_space, self.action_space)
        parts = (self._sensor, self._actuator, self._randomisation)
        fits = {
            "task": f"{module_of(kind)}.{kind.__qualname__}", "control period": self.control_period,
            "imperfections": [type(part).__name__ for part in parts if part is not None],
            "spaces": [*map(_bounds, spaces)],
        }  # fmt: skip
        for part in (self._sensor, self._actuator):
            fits |= part.settings if part is not None else {}
        return fits

    def _differs(self, variation: Variation) -> bool:
        return variation is not self._variation and variation != self._variation  # mostly it is the same one

    def _vary(self, variation: Variation) -> None:
        changed = self._variation.undone.merged(variation)  # what it doesn't name is nominal again
        try:
            self.backend.vary(changed)
        except BaseException:
            with contextlib.suppress(Exception):  # an unknown name, or another type: nothing was varied
                self.backend.vary(changed.undone.merged(self._variation))
            raise
        self._variation = variation

    def _check_open(self) -> None:
        if self._closed:
            raise gymnasium.error.ClosedEnvironmentError("this environment is closed; make another")
