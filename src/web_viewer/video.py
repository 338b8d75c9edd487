"""MP4 files, encoded frame by frame by imageio-ffmpeg: memory holds one frame at a time."""

from collections.abc import Generator
from pathlib import Path

import numpy as np

TIMEOUT = 300.0  # [s] for ffmpeg to encode what it still has when the file is closed
OUTPUT = (
    "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2",  # the format has even sizes only
    "-preset", "veryfast", "-crf", "20", "-movflags", "+faststart", "-f", "mp4",
)  # fmt: skip


class EncoderFailed(RuntimeError):
    """ffmpeg has failed; it has written the reason to standard error."""


class Mp4Writer:
    """Writes a file that can be played once it is closed.

    Args:
        path: The file; an older one is replaced.
        rate: Of the frames [Hz].
    """

    def __init__(self, path: Path, rate: float) -> None:
        self._path, self._rate = path, rate
        self._frames: Generator[None, bytes, None] | None = None
        self._shape: tuple[int, ...] = ()

    def add(self, frame: np.ndarray) -> None:
        """Adds a frame (H, W, 3) of uint8, of the first frame's size.

        Raises EncoderFailed if ffmpeg has ended, ValueError for another size.
        """
        try:
            if self._frames is None:
                self._shape, self._frames = frame.shape, self._start(*frame.shape[:2])
            if frame.shape != self._shape:
                raise ValueError(f"a frame of shape {frame.shape} in a video of {self._shape}")
            self._frames.send(np.ascontiguousarray(frame, np.uint8).tobytes())
        except (OSError, StopIteration) as error:
            self._frames = None
            raise EncoderFailed(f"ffmpeg can't write {self._path}") from error

    def _start(self, height: int, width: int) -> Generator[None, bytes, None]:
        import imageio_ffmpeg

        # It starts ffmpeg in a process group of its own: a Ctrl-C doesn't cut the file off.
        frames: Generator[None, bytes, None] = imageio_ffmpeg.write_frames(
            self._path, (width, height), fps=self._rate, codec="libx264", quality=None,
            macro_block_size=1, ffmpeg_log_level="error", ffmpeg_timeout=TIMEOUT,
            output_params=list(OUTPUT),
        )  # fmt: skip
        frames.send(None)  # type: ignore[arg-type]  # runs up to the first frame
        return frames

    def close(self) -> None:
        """Completes the file; may be called twice; raises EncoderFailed if the file can't be played."""
        frames, self._frames = self._frames, None
        if frames is None:
            return
        frames.close()
        # imageio-ffmpeg doesn't report ffmpeg's exit code. ffmpeg moves the index to the front last.
        if not self._path.exists() or b"moov" not in self._path.open("rb").read(64):
            raise EncoderFailed(f"ffmpeg couldn't write {self._path}")
