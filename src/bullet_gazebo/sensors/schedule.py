"""When sensors measure: at the first tick that is due, in the file's order, if somebody listens.

Due times are whole multiples of a sensor's period after it was made or time was reset (in ns, without
drift), whoever listens: a late or second listener changes no measurement. After a service has moved bodies,
all that is heard measures at once. See docs/contract/sensors.md 0.4.
"""

from collections.abc import Callable

from bullet_gazebo.simulator import NANOSECONDS, Simulator

Measure = Callable[[int], None]


class SensorClock:
    """The clock of one sensor. `Schedule.add` makes it."""

    def __init__(
        self, schedule: "Schedule", rate: float, measure: Measure, at_once: bool, now: int
    ) -> None:
        self._schedule = schedule
        self.at_once = at_once
        self.period = round(NANOSECONDS / rate) if rate > 0.0 else 0  # [ns]
        self.measure = measure
        self.begin = self.last = now  # [ns]
        self.heard = False
        self.plan(now)

    def hear(self, is_heard: bool) -> None:
        """Says whether somebody listens.

        The caller doesn't hold the simulator's lock.
        """
        self._schedule.hear(self, is_heard)

    def end(self) -> None:
        """Ends the measurements."""
        self._schedule.remove(self)

    def plan(self, now: int) -> None:
        """Finds the first due time after `now` [ns]."""
        passed = (now - self.begin) // self.period if self.period else now - self.begin
        self.due = self.begin + (passed + 1) * (self.period or 1)


class Schedule:
    """The clocks of all sensors. Without listeners it costs a tick nothing."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._clocks: list[SensorClock] = []
        self._due = 0
        self.moves = 0  # how often something other than time has moved bodies
        self.moved_at = -1  # when it did so last [ns]
        self.prepare: list[Callable[[], None]] = []  # called before the measurements of one time
        sim.moved.append(self._moved)

    def add(self, rate: float, measure: Measure, at_once: bool = True) -> SensorClock:
        """Returns a clock that calls `measure` with the time [ns], under the simulator's lock.

        Args:
            rate: in Hz of simulated time; 0 is every step.
            measure: takes a measurement and sends it.
            at_once: whether it measures as soon as somebody listens, if a period has passed since the last
                measurement.
        """
        with self._sim.lock:
            clock = SensorClock(self, rate, measure, at_once, self._sim.now)
            self._clocks.append(clock)
        return clock

    def remove(self, clock: SensorClock) -> None:
        with self._sim.lock:
            self._clocks.remove(clock)
            self._listen()

    def hear(self, clock: SensorClock, is_heard: bool) -> None:
        with self._sim.lock:
            if clock not in self._clocks or clock.heard == is_heard:
                return
            clock.heard = is_heard
            now = self._sim.now
            clock.plan(now)
            self._listen()
            if is_heard and clock.at_once and now - clock.last > clock.period:
                self._take([clock])

    def _listen(self) -> None:
        """Takes part in the ticks while something is heard."""
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
        for prepare in self.prepare:
            prepare()
        now = self._sim.now
        for clock in clocks:
            clock.last = now
            clock.plan(now)
        self._due = min(clock.due for clock in self._clocks if clock.heard)
        for clock in clocks:
            clock.measure(now)

    def _moved(self) -> None:
        """Measures afresh all that is heard, after a service has moved bodies or reset time."""
        self.moves += 1
        now = self.moved_at = self._sim.now
        for clock in self._clocks:
            if now < clock.last:
                clock.begin = clock.last = now
        heard = [clock for clock in self._clocks if clock.heard]
        if heard:
            self._take(heard)
