"""When time passes although the script doesn't wait: once for each round of commands, or as the user says."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

SELF_PACED = (
    2  # rounds in a row in which the script has waited by itself: no triggers until it doesn't
)


class Triggers:
    """Decides at each publish and each call.

    Without names given, a round of commands to the simulator is one: a script for several joints publishes
    several in a row. A topic that comes again begins the next round. If no time has passed by then, the
    script doesn't wait by itself: time passes at once, and from then on after the last topic of each round.
    A script that waits after its commands needs no triggers, and gets none.
    """

    def __init__(self, names: Collection[str] | None) -> None:
        """Topics and services; none for no triggers, None for all commands."""
        self._names = None if names is None else frozenset(names)
        self.seen: dict[str, None] = {}  # names of topics and services, in order
        self._round: list[str] = []  # topics published since the round began
        self._last: str | None = None  # the topic that ended the round before
        self._stepped = False  # in this round
        self._waited = False  # in this round
        self._self_paced = 0  # rounds in a row
        self._looks: Counter[tuple[str, bytes]] = Counter()  # since time has passed
        self._polled: set[tuple[str, bytes]] = set()  # what the script has waited for in this way

    def waited(self) -> None:
        """Time has passed because the script waited."""
        self._waited = True
        self.passed()

    def passed(self) -> None:
        """Time has passed."""
        self._looks.clear()

    def before(self, topic: str, is_command: bool) -> bool:
        """Whether time passes before a message is published: a round ended earlier than the one before."""
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
        """Whether time passes after a message was published."""
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
        """Whether time passes after a service was called."""
        self.seen.setdefault(service)
        return self._names is not None and service in self._names

    def unused(self) -> list[str]:
        """Names that were given, and that the script never published on nor called."""
        return sorted((self._names or frozenset()) - self.seen.keys())

    def polled(self, what: str, often: int, detail: bytes) -> bool:
        """Whether time passes because the script looks at the same thing again and again."""
        if self._names is not None:
            return False
        look = (what, detail)
        self._looks[look] += 1
        if self._looks[look] <= (1 if look in self._polled else often):
            return False
        self._polled.add(look)
        return True
