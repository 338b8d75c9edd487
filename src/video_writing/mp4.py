"""MP4 by ffmpeg, a process of its own that is fed frame by frame: memory holds one of them."""

import importlib.util
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

END_TIMEOUT = 300.0  # [s] for the encoder to write what it has left


class EncoderFailed(RuntimeError):
    """ffmpeg is missing, or has given up; the text says why."""


def find_encoder() -> str:
    """The ffmpeg that imageio-ffmpeg brings along, or else the system's.

    Raises:
        EncoderFailed: if there is none.
    """
    if importlib.util.find_spec("imageio_ffmpeg"):
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    found = shutil.which("ffmpeg")
    if found is None:
        raise EncoderFailed("there is no ffmpeg")
    return found


class Mp4Writer:
    """A file that grows with each frame, and can be played once it is closed.

    Args:
        path: the file; an older one is replaced.
        rate: of the frames [Hz].
        encoder: a path of ffmpeg.
    """

    def __init__(self, path: Path, rate: float, encoder: str) -> None:
        self._path, self._rate, self._encoder = path, rate, encoder
        self._process: subprocess.Popen[bytes] | None = None
        self._size = (0, 0)
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - for as long as the encoder runs

    def add(self, frame: np.ndarray) -> None:
        """Adds a frame, (H, W, 3) of uint8, of the first one's size.

        Raises:
            EncoderFailed: if ffmpeg has given up.
            ValueError: for another size.
        """
        height, width, _ = frame.shape
        if self._process is None:
            self._size = (width, height)
            self._process = self._start()
        if (width, height) != self._size:
            raise ValueError(f"a frame of {width} x {height} in a video of {self._size}")
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(np.ascontiguousarray(frame, np.uint8).tobytes())
        except OSError as error:
            self.close()
            raise EncoderFailed("ffmpeg gave up") from error

    def _start(self) -> subprocess.Popen[bytes]:
        width, height = self._size
        command = [
            self._encoder, "-hide_banner", "-loglevel", "error", "-y",
            "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
            "-framerate", f"{self._rate:.6g}", "-i", "-", "-an",
            "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2",  # the format knows even sizes only
            "-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-pix_fmt", "yuv420p",
            "-movflags", "+faststart", "-f", "mp4", str(self._path),
        ]  # fmt: skip
        try:
            # In a session of its own a Ctrl-C doesn't reach it, so that the file is ended well.
            return subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=self._errors,
                start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            raise EncoderFailed(f"{self._encoder} can't be started: {error.strerror}") from error

    def close(self) -> None:
        """Ends the file; may be called twice.

        Raises:
            EncoderFailed: if ffmpeg couldn't write it; the text is its own.
        """
        process, self._process = self._process, None
        if process is None:
            return
        try:
            process.communicate(timeout=END_TIMEOUT)
        except subprocess.TimeoutExpired as error:
            process.kill()
            process.wait()
            raise EncoderFailed(f"ffmpeg takes more than {END_TIMEOUT:g} s") from error
        if process.returncode:
            self._errors.seek(0)
            lines = self._errors.read().decode(errors="replace").strip().splitlines()
            raise EncoderFailed(f"ffmpeg: {lines[-1] if lines else process.returncode}")
