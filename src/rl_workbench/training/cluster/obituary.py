"""A line for the user if this process ends without a word, as Ray ends a process whose node is lost."""

import contextlib
import subprocess
from collections.abc import Callable, Iterator
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
def obituary(line: str, folder: Path | None = None) -> Iterator[Callable[[str], None]]:
    """As long as it is entered, another process waits to say the line on standard error.

    What it gives has another line said in its place, at once; to be called by who then ends this process.

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
    told = speaker.stdin

    def tell(last: str) -> None:
        with contextlib.suppress(BrokenPipeError):
            told.write(f"{last}\n".encode())
            told.flush()

    try:
        yield tell
    finally:
        tell(ORDERLY)
        with contextlib.suppress(BrokenPipeError):
            told.close()
        speaker.wait()
