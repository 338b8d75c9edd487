"""Triggers of time for scripts that don't wait: rounds of commands, or topics that the user names."""

from collections import Counter
from collections.abc import Collection

SELF_PACED = 2  # rounds in a row with a wait of the script's own: no triggers until a round without


class Triggers:
    """Decides at each publish and each call.

    Without names, each round of commands to the simulator triggers once: a script for several joints
    publishes several in a row. A repeated topic begins the next round. If no time has passed by then, the
    script doesn't wait by itself: time passes at once, and from then on after the last topic of each round.
    A script that waits after its commands gets no triggers. `names` are topics and services; empty for no
    triggers, None for all commands.
    """

    def __init__(self, names: Collection[str] | None) -> None:
        self._names = None if names is None else frozenset(names)
        self.seen: dict[str, None] = {}  # topics and services in order of first use
        self._round: list[str] = []  # topics published since the round began
        self._last: str | None = None  # the topic that ended the round before
        self._stepped = False  # in this round
        self._waited = False  # in this round
        self._self_paced = 0  # rounds in a row
        self._looks: Counter[tuple[str, bytes]] = Counter()  # since time last passed
        self._polled: set[tuple[str, bytes]] = set()  # looks that count as waits

    def waited(self) -> None:
        """Notes that time has passed because the script waited."""
        self._waited = True
        self.passed()

    def passed(self) -> None:
        """Notes that time has passed: looks are counted from zero."""
        self._looks.clear()

    def before(self, topic: str, is_command: bool) -> bool:
        """Returns whether time passes before a message: its topic begins a new round, and none has passed."""
        self._looks.clear()
        if self._names is not None or not is_command or topic not in self._round:
            return False
        missed = not (self._stepped or self._waited)
        self._self_paced = self._self_paced + 1 if self._waited else 0
        if missed:
            self._last = self._round[-1]
        self._round, self._stepped, self._waited = [], False, False
        return missed

    def after(self, topic: str, is_command: bool) -> bool:
        """Returns whether time passes after a message."""
        self.seen.setdefault(topic)
        if self._names is not None:
            return topic in self._names
        if not is_command:
            return False
        self._round.append(topic)
        if self._stepped or self._self_paced >= SELF_PACED or topic != self._last:
            return False
        self._stepped = True
        return True

    def called(self, service: str) -> bool:
        """Returns whether time passes after a service call."""
        self.seen.setdefault(service)
        return self._names is not None and service in self._names

    def unused(self) -> list[str]:
        """Returns the given names that the script has neither published on nor called."""
        return sorted((self._names or frozenset()) - self.seen.keys())

    def polled(self, what: str, often: int, detail: bytes) -> bool:
        """Returns whether time passes because the script keeps looking at the same thing."""
        if self._names is not None:
            return False
        look = (what, detail)
        self._looks[look] += 1
        if self._looks[look] <= (1 if look in self._polled else often):
            return False
        self._polled.add(look)
        return True
