"""MP4 files: they can be played, or one line says why not."""

import sys
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from web_viewer.video import EncoderFailed, Mp4Writer

FRAMES = [np.full((31, 45, 3), 8 * level, np.uint8) for level in range(20)]


@pytest.fixture
def ffmpeg(tmp_path: Path, monkeypatch):
    """Puts a Python program in ffmpeg's place."""

    def replace(program: str) -> None:
        path = tmp_path / "ffmpeg"
        path.write_text(f"#!{sys.executable}\n{program}\n")
        path.chmod(0o755)
        monkeypatch.setattr(imageio_ffmpeg._io, "get_ffmpeg_exe", lambda: str(path))

    return replace


def test_what_was_written_can_be_read(tmp_path: Path):
    path = tmp_path / "a.mp4"
    writer = Mp4Writer(path, 12.5)
    for frame in FRAMES:
        writer.add(frame)
    writer.close()
    writer.close()
    read = imageio_ffmpeg.read_frames(str(path))
    about = next(read)
    assert about["size"] == (46, 32) and about["fps"] == 12.5 and about["codec"] == "h264"
    levels = [np.frombuffer(each, np.uint8).mean() for each in read]
    assert len(levels) == len(FRAMES) and levels[-1] > levels[0] + 100


def test_a_frame_of_another_size_is_refused(tmp_path: Path):
    writer = Mp4Writer(tmp_path / "a.mp4", 10.0)
    writer.add(FRAMES[0])
    with pytest.raises(ValueError, match=r"\(4, 5, 3\)"):
        writer.add(np.zeros((4, 5, 3), np.uint8))
    writer.close()


def test_an_encoder_that_fails_at_once_is_one_line(tmp_path: Path, ffmpeg):
    ffmpeg("import sys; sys.exit(1)")
    writer = Mp4Writer(tmp_path / "a.mp4", 10.0)
    with pytest.raises(EncoderFailed, match=r"can't write .*a\.mp4"):
        for _ in range(10_000):
            writer.add(np.zeros((100, 100, 3), np.uint8))


def test_an_encoder_that_fails_at_the_end_is_one_line(tmp_path: Path, ffmpeg):
    ffmpeg("import sys; sys.stdin.buffer.read(); sys.exit(1)")
    writer = Mp4Writer(tmp_path / "a.mp4", 10.0)
    writer.add(FRAMES[0])
    with pytest.raises(EncoderFailed, match=r"couldn't write .*a\.mp4"):
        writer.close()
