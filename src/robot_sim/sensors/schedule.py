"""The sensor schedule: each measures at the first tick that is due, in the file's order, if somebody listens.

Due times are whole multiples of a sensor's period after it was made or time was reset (in ns, without
drift), whoever listens: a late or second listener changes no measurement. A reset with a seed begins them
anew. After a reset all that is heard measures at once, after a move of a model what that model carries.
See docs/contract/sensors.md 0.4.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from robot_sim.constants import NANOSECONDS
from robot_sim.moves import Moved
from robot_sim.physics.model import Model
from robot_sim.simulator import Simulator
from robot_sim.state_dict import Shared, Stateful

Measure = Callable[[int], None]
SLOWEST = 1e-9  # [Hz]
LONG_AGO = -(10**18)  # [ns]


class Move(NamedTuple):
    """The last move of a model."""

    number: int  # of the world's moves until then
    at: int  # [ns]


NEVER = Move(0, LONG_AGO)


@dataclass(eq=False)
class SensorClock(Stateful):
    """The clock of one sensor, whose owner saves its state. `Schedule.begin` makes it."""

    non_persistent = ("schedule", "measure", "listens", "at_once", "heard", "has_newcomer")

    schedule: "Schedule"
    model: Model
    measure: Measure
    listens: Callable[[], bool]
    at_once: bool
    last: int = LONG_AGO  # time of the last measurement [ns], if nothing was moved since
    heard: bool = False
    has_newcomer: bool = False

    def set_rate(self, rate: float, begin: int, now: int) -> None:
        """Measures at whole periods of a rate [Hz] after `begin`, from `now` on [ns]; 0 is every step."""
        self.period = round(NANOSECONDS / max(rate, SLOWEST)) if rate > 0.0 else 0  # [ns]
        self.begin = begin
        self.plan(now)

    def look(self, somebody_came: bool = False) -> None:
        """Notes that listeners may have come or gone; takes no lock, so rospy's callbacks may call it."""
        self.has_newcomer = self.has_newcomer or somebody_came
        self.schedule.look()

    def end(self) -> None:
        """Ends the measurements. The caller doesn't hold the simulator's lock."""
        self.schedule.end(self)

    def plan(self, now: int) -> None:
        """Finds the first due time after `now` [ns]."""
        period = self.period or 1
        self.due = self.begin + ((now - self.begin) // period + 1) * period


class Schedule(Shared, Stateful):
    """The clocks of all sensors. Without listeners ticks cost nothing."""

    non_persistent = ("_clocks", "_due", "_is_looking", "prepare")

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._clocks: list[SensorClock] = []
        self._due = 0
        self._is_looking = False
        self.moves = 0  # how often something other than time has moved bodies
        self.moved_at = LONG_AGO  # when it did so last [ns]
        self.last_reset = NEVER
        self._moves_of: dict[str, Move] = {}  # since then, by names of models
        self.moves_before_seed = 0
        self._begins_anew = False  # with the next reset
        self.prepare: list[Callable[[], None]] = []  # called before the measurements of one time
        sim.moves.listeners.append(self._moved)
        sim.before_advance.append(self._catch_up)
        sim.reseeded.append(self._reseeded)
        sim.restored.append(self.restored)
        sim.parts["schedule"] = self

    def begin(
        self, model: Model, rate: float, measure: Measure, listens: Callable[[], bool], at_once: bool = True
    ) -> SensorClock:
        """Returns a clock that calls `measure` with the time [ns]; the caller holds the simulator's lock.

        Args:
            model: That carries the sensor.
            rate: In Hz of simulated time; 0 is every step.
            measure: Takes a measurement and sends it.
            listens: Returns whether somebody listens; called under the simulator's lock.
            at_once: Whether it measures as soon as somebody listens, if a period has passed since the last
                measurement or something was moved.
        """
        clock = SensorClock(self, model, measure, listens, at_once)
        clock.set_rate(rate, self._sim.now, self._sim.now)
        self._clocks.append(clock)
        return clock

    def end(self, clock: SensorClock) -> None:
        with self._sim.lock:
            self.fail(clock)

    def fail(self, clock: SensorClock) -> None:
        """Ends a clock, if it hasn't ended; the caller holds the simulator's lock."""
        if clock in self._clocks:
            self._clocks.remove(clock)
            self._take_part()

    def look(self) -> None:
        """Reviews the listeners soon, in a thread of its own."""
        if not self._is_looking:
            self._is_looking = True
            threading.Thread(target=self._look, name="sensors' listeners", daemon=True).start()

    def _look(self) -> None:
        with self._sim.lock:
            self._catch_up()

    def _catch_up(self) -> None:
        if self._is_looking:
            self.review()

    def review(self) -> None:
        """Updates which clocks have listeners; the caller holds the simulator's lock."""
        self._is_looking = False
        now = self._sim.now
        fresh = []
        for clock in self._clocks:
            was_heard, clock.heard = clock.heard, clock.listens()
            came = clock.has_newcomer
            if came:  # a later one waits for the next review
                clock.has_newcomer = False
            came = came or not was_heard
            if clock.heard and not was_heard:
                clock.plan(now)
            # Who was sent the last one may be gone, unnoticed: what there is now is measured anew.
            moved_at = self.last_move(clock.model).at
            is_old = clock.last in (now, moved_at) or now - clock.last >= max(clock.period, 1)
            if clock.heard and came and clock.at_once and is_old:
                fresh.append(clock)
        self._take_part()
        self._take(fresh)

    def _take_part(self) -> None:
        """Follows the ticks only while a clock has listeners."""
        heard = [clock.due for clock in self._clocks if clock.heard]
        self._due = min(heard, default=0)
        # A new list: the old one may be in use by a tick.
        others = [each for each in self._sim.listeners if each != self._tick]
        self._sim.listeners = [*others, self._tick] if heard else others

    def _tick(self, now: int) -> None:
        if now < self._due:
            return
        self._take([clock for clock in self._clocks if clock.heard and now >= clock.due])

    def _take(self, clocks: list[SensorClock]) -> None:
        if not clocks:
            return
        for prepare in self.prepare:
            prepare()
        now = self._sim.now
        for clock in clocks:
            clock.last = now
            clock.plan(now)
        self._due = min((clock.due for clock in self._clocks if clock.heard), default=0)
        for clock in clocks:
            clock.measure(now)

    def _reseeded(self, seed: int) -> None:
        self.moves_before_seed, self._begins_anew = self.moves, True

    def restored(self) -> None:
        """Reschedules the clocks after a restore, for the present listeners."""
        now = self._sim.now
        for clock in self._clocks:
            # One that is newer than the snapshot, or wasn't heard then.
            if not now < clock.due <= now + max(clock.period, 1):
                clock.plan(now)
        self._take_part()

    def last_move(self, model: Model) -> Move:
        """Returns the last move of a model by a service or reset."""
        return self._moves_of.get(model.name, self.last_reset)

    def _moved(self, moved: Moved) -> None:
        """Measures at once: all sensors with listeners after a reset, else those of the moved models."""
        self.moves += 1
        now = self.moved_at = self._sim.now
        move = Move(self.moves, now)
        anew = False
        if moved is None:
            self.last_reset, self._moves_of = move, {}
            anew, self._begins_anew = self._begins_anew, False
        else:
            there = self._sim.world.models
            kept = {name: each for name, each in self._moves_of.items() if name in there}
            self._moves_of = {**kept, **dict.fromkeys([each.name for each in moved], move)}
        concerned = [each for each in self._clocks if moved is None or each.model in moved]
        for clock in concerned:
            if anew or now < clock.begin or now < clock.last:
                clock.begin = now
            clock.last = LONG_AGO
            clock.plan(now)
        self._take([clock for clock in concerned if clock.heard])
