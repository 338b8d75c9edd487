"""A line for the user if this process ends without a word, as Ray ends a process whose node is lost."""

import contextlib
import subprocess
from collections.abc import Iterator
from pathlib import Path

ORDERLY = "orderly"
# A constant text: line and folder come as arguments, so nothing of them is parsed. Of those who have files of
# the folder open, only who writes there belongs to the cluster; so does this process, but it ends by itself.
WAIT_FOR_THE_END = r"""
read -r line || line=$0
[ "$line" = orderly ] || printf "%s\n" "$line" >&2
[ -z "$1" ] && exit
find /proc/[0-9]*/fd -perm -u+w -lname "$1/*" 2> /dev/null | cut -d / -f 3 | sort -u | grep -vx "$PPID" |
    xargs -r kill -9
"""


@contextlib.contextmanager
def obituary(line: str, folder: Path | None = None) -> Iterator[int]:
    """As long as it is entered, another process waits to say the line on standard error.

    A line that is written to the file whose number it gives is said in its place, at once, by who then ends
    this process.

    Args:
        folder: of a cluster that is this process's own; what writes its logs there ends with it, however
            it ends: Ray's agents can outlive it by a minute.
    """
    # Ctrl-C in the terminal isn't meant for it.
    speaker = subprocess.Popen(
        ["/bin/sh", "-c", WAIT_FOR_THE_END, line, str(folder or "")],
        stdin=subprocess.PIPE,
        start_new_session=True,
    )
    assert speaker.stdin is not None
    try:
        yield speaker.stdin.fileno()
    finally:
        with contextlib.suppress(BrokenPipeError):
            speaker.stdin.write(f"{ORDERLY}\n".encode())
            speaker.stdin.close()
        speaker.wait()
