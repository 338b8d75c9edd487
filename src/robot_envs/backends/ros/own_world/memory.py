"""Whether there is the memory for as many simulators as are asked for."""

from pathlib import Path

from robot_envs.errors import RobotEnvError

EACH = 120_000_000  # [bytes] of a master and a simulator with a robot, without what they share with others
MEMINFO, CONTROL_GROUP = Path("/proc/meminfo"), Path("/sys/fs/cgroup")


def check(count: int) -> None:
    """Makes sure of it.

    Raises:
        RobotEnvError: if there isn't.
    """
    available = free()
    if available is not None and count * EACH > available:
        what = "a simulator needs" if count == 1 else f"{count} simulators need"
        raise RobotEnvError(
            f"{what} about {_told(count * EACH)} of memory, and {_told(available)} are free: make fewer "
            'environments, or make them in this process (backend="bullet"), where each needs a fraction'
        )


def free() -> int | None:
    """Memory [bytes] that new processes may take; None where the kernel doesn't tell."""
    return min((each for each in (_machine(), _group()) if each is not None), default=None)


def _machine() -> int | None:
    try:
        for line in MEMINFO.read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError):
        pass
    return None


def _group() -> int | None:
    """What a container leaves; its file caches count as used, though they could be given up."""
    try:
        limit = (CONTROL_GROUP / "memory.max").read_text(encoding="ascii")
        used = (CONTROL_GROUP / "memory.current").read_text(encoding="ascii")
        stat = (CONTROL_GROUP / "memory.stat").read_text(encoding="ascii").split()
        return int(limit) - int(used) + int(stat[stat.index("inactive_file") + 1])
    except (OSError, ValueError):  # no such files, or no limit
        return None


def _told(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.0f} MB"
