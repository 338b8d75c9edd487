"""A line for the user if this process ends without a word, as Ray ends a process whose node is lost."""

import contextlib
import subprocess
from collections.abc import Iterator

# A constant text: the line comes as an argument, so nothing of it is parsed.
WAIT_FOR_THE_END = 'read -r orderly || printf "%s\\n" "$0" >&2'


@contextlib.contextmanager
def obituary(line: str) -> Iterator[None]:
    """As long as it is entered, another process waits to say the line on standard error."""
    # Ctrl-C in the terminal isn't meant for it.
    speaker = subprocess.Popen(
        ["/bin/sh", "-c", WAIT_FOR_THE_END, line], stdin=subprocess.PIPE, start_new_session=True
    )
    assert speaker.stdin is not None
    try:
        yield
    finally:
        with contextlib.suppress(BrokenPipeError):
            speaker.stdin.write(b"orderly\n")
            speaker.stdin.close()
        speaker.wait()
