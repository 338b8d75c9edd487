"""Activity of processes and threads, observed in /proc."""

from pathlib import Path

from lockstep_runner import originals

LOOK = 0.03  # [s of wall time] between two checks
QUIET = 5  # idle checks in a row
WORKING = "RD"  # states of a process: running, waiting for a disk


class Seen:
    """The activity of a process or thread, seen in its folder in /proc; `quiet` idle checks mean rest."""

    def __init__(self, place: Path, quiet: int = QUIET) -> None:
        self.place = place
        self._looks = quiet
        self._used = -1  # [ticks] of processor time
        self._quiet = 0  # idle checks in a row
        self._next = 0.0

    def is_quiet(self) -> bool:
        """Returns whether the last few checks found it idle; checks at most once per LOOK."""
        if originals.monotonic() >= self._next:
            self._next = originals.monotonic() + LOOK
            look = look_at(self.place)
            works = look is not None and (look[0] in WORKING or look[1] != self._used)
            self._quiet = 0 if works else self._quiet + 1
            self._used = look[1] if look else -1
        return self._quiet >= self._looks


def look_at(place: Path) -> tuple[str, int] | None:
    """Returns state and processor time [ticks] of a process or thread, None if it has ended."""
    try:
        fields = Path(place, "stat").read_text().rpartition(") ")[2].split()
    except OSError:
        return None
    return fields[0], int(fields[11]) + int(fields[12])
