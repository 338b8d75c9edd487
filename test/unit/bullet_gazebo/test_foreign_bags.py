"""Bags of unknown origin: what their texts can't do, and what is refused."""

import io
import json
import os
import random
from types import SimpleNamespace

import pytest
import rosbag
from bullet_gazebo_msgs.msg import Journal as JournalMessage
from bullet_gazebo_msgs.msg import JournalEntry
from support.ros.journal_bags import FACTS, START, entry, written, written_raw

from bullet_gazebo.journal import recorded
from bullet_gazebo.journal.recorded import NoRecording, RecordedJournal
from bullet_gazebo.node import replay_command
from bullet_gazebo.node.gzserver import parse_args
from bullet_gazebo.node.start import arguments_of, check_facts
from file_access.limited import LimitedProcess


@pytest.fixture(autouse=True, scope="module")
def _one_reader():
    """Read all bags in one process, where each would start its own."""
    shared = LimitedProcess(f"{recorded.__name__}:read_journal", recorded.LIMITS)
    asking = SimpleNamespace(ask=shared.ask, close=lambda: None)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(recorded, "LimitedProcess", lambda *_: asking)
        yield
    shared.close()


def test_a_world_file_that_has_gone_is_written_again(tmp_path):
    facts = FACTS | {"physics": "mujoco", "paused": True, "seed": 3, "world_text": "<sdf/>"}
    *options, path = arguments_of(facts, tmp_path)
    cameras = ["--camera-scale=1.0", "--renderer=rays"]
    assert options == ["--lockstep", "--physics=mujoco", *cameras, "-u", "--seed=3"]
    assert path == str(tmp_path / "recorded.world")
    assert (tmp_path / "recorded.world").read_text() == "<sdf/>"


@pytest.mark.parametrize("text", ["--video=x.png", "--journal=x", "-u", "__log:=x", "../x", "\0"])
@pytest.mark.parametrize("world_text", [None, "<sdf/>"])
def test_no_text_of_a_bag_becomes_an_option_or_a_path(text, world_text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    facts = FACTS | {"world": text, "world_text": world_text, "physics": text}
    check_facts(facts)
    args = parse_args(arguments_of(facts, tmp_path))
    assert (args.video, args.journal, args.paused, args.ignored) == ([], "", False, [])
    assert args.world == str(tmp_path / "recorded.world")


@pytest.mark.parametrize(
    "wrong",
    [[], {"seed": "--video=x"}, {"paused": 1}, {"hashes": "7x"}, {"hashes": "4294967296"}, {"series": ""}],
)  # fmt: skip
def test_a_start_that_no_simulator_had_is_refused(wrong, tmp_path, capsys):
    data = json.dumps(FACTS | wrong if wrong else wrong).encode()
    path = written(tmp_path / "run.bag", entry(0, data=data), entry(1))
    assert replay_command.main([str(path)]) == 2
    assert "damaged" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("parameters", "code"),
    [
        ({"/gazebo/plugins": [{"libx.so": "os:abort"}]}, "os:abort"),
        ({"/gazebo": [{"plugins": {"libx.so": "os:abort"}}]}, "os:abort"),
        ({"/": [{"gazebo/plugins/libx.so": "os:abort"}]}, "os:abort"),
        ({"/arm//elbow": [{"type": "antigravity/X"}]}, "antigravity/X"),
        ({"/arm": [{"elbow": {"type": "antigravity/X"}}]}, "antigravity/X"),
        ({"/elbow/type": ["effort_controllers/JointEffortController"], "/gazebo/plugins": []}, ""),
    ],
)
def test_a_bag_imports_code_only_if_it_is_trusted(parameters, code, tmp_path, capsys):
    load = entry(1, parameters=json.dumps(parameters))
    path = written(tmp_path / "run.bag", entry(0, **START), load)
    assert RecordedJournal(path).foreign_code() == ([code] if code else [])
    if code:
        assert replay_command.main([str(path)]) == 2
        said = capsys.readouterr().err
        assert f"{path} would import {code}; if you trust it, add --trust" in said


def test_the_definition_of_a_message_that_a_bag_holds_is_not_run(tmp_path):
    path, made = tmp_path / "run.bag", tmp_path / "made"
    definition = f"string open({str(made)!r},'w').close();A=1\n{JournalMessage._full_text}"
    message = io.BytesIO()
    JournalMessage([entry(0, **START)]).serialize(message)
    written_raw(path, message.getvalue(), JournalMessage._md5sum, definition)
    assert RecordedJournal(path).facts == FACTS
    assert not made.exists()
    list(rosbag.Bag(str(path)).read_messages(raw=True))
    assert made.exists()  # as rosbag does by itself


def test_a_pipe_and_a_device_are_refused_at_once(tmp_path, capsys):
    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path / "fifo", "/dev/zero", tmp_path):
        assert replay_command.main([str(path)]) == 2
        assert capsys.readouterr().err == f"replay.py: {path}: it is not a file\n"


@pytest.mark.slow
def test_a_damaged_bag_is_refused_or_read(tmp_path):
    """Whatever bytes are wrong; what can be read is compared as any recording is."""
    start, step = entry(0, **START), entry(1, kind=JournalEntry.COMMAND, name="advance", data=b"5")
    step.parameters = '{"/arm": [{"p": 1.0}]}'
    whole = written(tmp_path / "run.bag", start, step).read_bytes()
    draw, outcomes, path = random.Random(5), set(), tmp_path / "damaged.bag"
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(draw.choice([0, 1, 5])):
            data[draw.randrange(len(data))] = draw.randrange(256)
        path.write_bytes(data[: draw.choice([len(data), draw.randrange(len(data))])])
        try:
            list(RecordedJournal(path).entries())
            outcomes.add("read")
        except NoRecording as fault:
            assert str(fault).startswith(f"{path}: ") and "\n" not in str(fault)
            outcomes.add("refused")
    assert outcomes == {"read", "refused"}
