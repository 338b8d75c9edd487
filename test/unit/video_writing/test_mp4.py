"""MP4 by ffmpeg: whole files, or one line."""

import sys
from pathlib import Path

import numpy as np
import pytest

from video_writing import mp4
from video_writing.mp4 import EncoderFailed, Mp4Writer, find_encoder

FRAMES = [np.full((31, 45, 3), 8 * level, np.uint8) for level in range(20)]


@pytest.mark.extras("imageio_ffmpeg")
def test_what_was_written_can_be_read(tmp_path: Path):
    import imageio_ffmpeg

    path = tmp_path / "a.mp4"
    writer = Mp4Writer(path, 12.5, find_encoder())
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
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!{sys.executable}\nimport sys; sys.stdin.buffer.read()\n")
    program.chmod(0o755)
    writer = Mp4Writer(tmp_path / "a.mp4", 10.0, str(program))
    with pytest.raises(ValueError, match="5 x 4"):
        for frame in (FRAMES[0], np.zeros((4, 5, 3), np.uint8)):
            writer.add(frame)
    writer.close()


def test_an_encoder_that_fails_says_why(tmp_path: Path):
    program = tmp_path / "ffmpeg"
    program.write_text(f"#!{sys.executable}\nimport sys; sys.exit('no room\\nleft on the disk')\n")
    program.chmod(0o755)
    writer = Mp4Writer(tmp_path / "a.mp4", 10.0, str(program))
    with pytest.raises(EncoderFailed, match="left on the disk"):
        for _ in range(10_000):
            writer.add(np.zeros((100, 100, 3), np.uint8))
        writer.close()


def test_an_encoder_that_is_none_says_so(tmp_path: Path):
    with pytest.raises(EncoderFailed, match="can't be started"):
        Mp4Writer(tmp_path / "a.mp4", 10.0, str(tmp_path)).add(FRAMES[0])


def test_the_systems_encoder_is_taken_where_the_extra_is_missing(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr(mp4.shutil, "which", lambda name: f"/usr/bin/{name}")
    assert find_encoder() == "/usr/bin/ffmpeg"
    monkeypatch.setattr(mp4.shutil, "which", lambda name: None)
    with pytest.raises(EncoderFailed, match="no ffmpeg"):
        find_encoder()
