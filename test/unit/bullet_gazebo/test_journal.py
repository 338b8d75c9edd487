"""The journal's order, bound and contents, bags that can't be replayed, and how differences are told."""

import errno
import io
import json
import math
import os
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest
import rosbag
import rospy
from bullet_gazebo_msgs.msg import JournalEntry
from gazebo_msgs.srv import SpawnModel, SpawnModelRequest, SpawnModelResponse
from genpy import Time
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from support.ros.journal_bags import FACTS, START, entry, written, written_raw

from bullet_gazebo.journal import journal_output
from bullet_gazebo.journal.journal import Entry, WorldJournal
from bullet_gazebo.journal.journal_output import JournalBag
from bullet_gazebo.journal.recorded import NoRecording, RecordedJournal, first_difference
from bullet_gazebo.node import replay, replay_command
from robot_sim.pictures.recording import RecordingError
from robot_sim.timing import FairLock, Holds

MS = 1_000_000  # [ns]
MODEL = (0.0,) * 13


@pytest.fixture
def sim():
    """A simulator's time and lock, and an empty world."""
    world = SimpleNamespace(version=0, models={})
    made = SimpleNamespace(lock=FairLock(), elapsed=0, now=0, world=world)
    made.holds = Holds(made.lock, lambda: None)
    made.await_holds = lambda: made.holds.await_end(threading.Event())
    return made


@pytest.fixture
def journal(sim):
    made = WorldJournal(sim)
    made.start({"series": 1})
    return made


def entries(journal):
    return journal.listen(lambda more: None)


def names(journal):
    return [entry.name for entry in entries(journal)]


def run_beside(work):
    thread = threading.Thread(target=work)
    thread.start()
    thread.join(30.0)


def test_entries_are_in_the_order_in_which_they_took_effect(sim, journal):
    """Not in that in which they came, or were done."""
    late = Entry(JournalEntry.SERVICE, "late", b"")
    assert journal.begin(late)

    def overtake():
        early = Entry(JournalEntry.SERVICE, "early", b"")
        assert journal.begin(early)
        with sim.lock:
            sim.elapsed += MS
        journal.end(early)

    run_beside(overtake)
    with sim.lock:
        pass
    journal.end(late)
    assert names(journal) == ["", "early", "late"]
    assert [each.number for each in entries(journal)] == [0, 1, 2]
    assert [(each.elapsed, each.ended) for each in entries(journal)] == [(0, 0), (0, MS), (MS, MS)]


def test_what_follows_from_an_entry_is_none_of_its_own(journal):
    with journal.command("outer"), journal.command("inner"):
        pass
    assert names(journal) == ["", "outer"]


def test_nothing_takes_effect_while_a_model_comes(sim, journal):
    held, over = threading.Event(), threading.Event()

    def spawn():
        with journal.command("spawn"), sim.holds.hold(30.0, over.set):
            held.set()
            meanwhile.start()
            with sim.lock:
                sim.elapsed += MS

    def place():
        with journal.command("place"), sim.lock:
            pass

    meanwhile = threading.Thread(target=place)
    run_beside(spawn)
    meanwhile.join(30.0)
    assert held.is_set()
    found = [(each.name, each.elapsed) for each in entries(journal)]
    assert found == [("", 0), ("spawn", 0), ("place", MS)] and not over.is_set()


def test_each_entry_has_the_parameters_that_it_read(journal):
    """What a handler writes itself, it writes in a replay too: the first value counts."""
    for values in ([[1], [3]], [[1]], [[]]):
        with journal.command("read"):
            for value in values:
                journal.note_parameter("/p", value)
    read = [json.loads(each.parameters) for each in entries(journal)[1:]]
    assert read == [{"/p": [1]}, {"/p": [1]}, {"/p": []}]


def test_beyond_its_bound_nothing_is_kept(sim):
    journal = WorldJournal(sim, most_kept=10_000)
    journal.start({})
    assert len(entries(journal)) == 1
    for _ in range(30):
        with journal.command("step"):
            pass
    assert entries(journal) is None


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        ([entry(0, **START), entry(1), entry(2)], ""),
        ([entry(0, **START), entry(1), entry(3)], "entry 2 is missing"),
        ([entry(1), entry(2)], "the beginning is missing"),
        ([entry(0, kind=JournalEntry.GONE), entry(7)], "the beginning is missing"),
    ],
)
def test_entries_are_read_in_their_order_and_once_and_gaps_are_refused(made, reason, tmp_path):
    path = written(tmp_path / "run.bag", *made)
    if not reason:
        assert [each.number for each in RecordedJournal(path).entries()] == [0, 1, 2]
        return
    with pytest.raises(NoRecording, match=reason):
        list(RecordedJournal(path).entries())


def other_topics(path):
    with rosbag.Bag(str(path), "w") as bag:
        bag.write("/number", Float64(1.0), Time(1))


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (Path.unlink, "No such file"),
        (lambda path: path.write_text("no bag"), "no bag, or damaged"),
        (lambda path: path.write_bytes(path.read_bytes()[:5000]), "rosbag reindex"),
        (other_topics, "no journal is in this bag"),
        (written_raw, "another version"),
    ],
)
def test_a_bag_that_cannot_be_replayed_is_refused_in_one_line(spoil, reason, tmp_path, capsys):
    path = written(tmp_path / "run.bag", entry(0, **START), entry(1, data=bytes(10_000)))
    spoil(path)
    assert replay_command.main([str(path)]) == 2
    said = capsys.readouterr().err
    assert reason in said and said.count("\n") == 1


@pytest.mark.parametrize(
    ("models", "parameters", "reason"),
    [
        (["amr"], [], "no model 'amr'.*did you mean 'arm'"),
        ([], [{"/elbw/pid": {"p": 1.0}}], "/elbw/pid.*did you mean '/elbow'"),
        ([], [{"/elbow/pid": {"p": 1.0}}, {"/other": 1}], "/other"),
        (["arm"], [{"/unused": 1, "/elbow/pid": {"p": 1.0}}, {"/": {}}], ""),
    ],
)
def test_changes_that_change_nothing_are_refused(models, parameters, reason, tmp_path):
    request = io.BytesIO()
    SpawnModelRequest(model_name="arm").serialize(request)
    spawn = entry(1, type=SpawnModel._type, data=request.getvalue())
    load = entry(2, parameters='{"/elbow": [{"pid": {"p": 2.0}}]}')
    found = RecordedJournal(written(tmp_path / "run.bag", entry(0, **START), spawn, load))
    if not reason:
        found.check_changes(models, parameters)
        return
    with pytest.raises(NoRecording, match=reason):
        found.check_changes(models, parameters)


def moving(joint=0.0, velocity=0.0, model=MODEL, **fields):
    fields |= {"models": ["arm"], "joints": ["arm::elbow"], "ended": 1234 * MS}
    return JournalEntry(observed=True, numbers=(*model, joint, velocity), **fields)


@pytest.mark.parametrize(
    ("now", "refusal", "said"),
    [
        (moving(), "", ""),
        (moving(joint=0.5), "", "at 1.234 s joint elbow of arm: 0.0 recorded, 0.5 now"),
        (moving(0.5, 0.5, (1.0,) * 13), "", "joint elbow of arm"),
        (moving(velocity=math.nan), "", "velocity of joint elbow of arm: 0.0 recorded, nan now"),
        (moving(velocity=0.5), "", "velocity of joint elbow of arm: 0.0 recorded, 0.5 now"),
        (moving(model=(0.0, 0.1, *MODEL[2:])), "", "position y of model arm: 0.0 recorded, 0.1 now"),
        (moving(joint=0.5, answer=4), "no such\nmodel", "answered otherwise than now: no such model"),
        (moving(answer=4), "", "answered otherwise than recorded"),
        (moving(name="/other"), "", "/other came"),
        (JournalEntry(observed=True, ended=1234 * MS), "", "models arm were recorded"),
        (JournalEntry(joints=["x"], ended=1234 * MS), "", ""),
        (JournalEntry(ended=1235 * MS), "", "was done, now at 1.235 s"),
    ],
)  # fmt: skip
def test_the_first_difference_is_named(now, refusal, said):
    now.answer = now.answer or 3
    found = first_difference(moving(answer=3), now, refusal)
    assert said in found and bool(said) == bool(found)


def test_a_state_that_is_no_number_equals_itself():
    recorded, now = (moving(joint=float("nan"), velocity=-0.0) for _ in range(2))
    assert first_difference(recorded, now, "") == ""


def test_a_bag_has_states_for_other_tools_and_time_never_goes_back(tmp_path):
    path = tmp_path / "run.bag"
    path.write_bytes(b"an older one")
    bag = JournalBag(path)
    first, second = moving(), moving(joint=0.5)
    first.ended, second.ended, second.now = 5 * MS, 6 * MS, Time(0)
    bag.write([first, first, second])
    bag.close()
    assert path.read_bytes() == b"an older one"
    read = list(rosbag.Bag(str(tmp_path / "run.2.bag")).read_messages("/joint_states"))
    assert [message.position[0] for _, message, _ in read] == [0.0, 0.5]
    assert [time.to_nsec() for _, _, time in read] == [5 * MS + 1, 6 * MS + 1]


def test_simulators_at_one_time_write_bags_of_their_own(tmp_path):
    for bag in [JournalBag(tmp_path / "run.bag") for _ in range(2)]:
        bag.write([moving()])
        bag.close()
    for name in ("run.bag", "run.2.bag"):
        assert rosbag.Bag(str(tmp_path / name)).get_message_count("/gazebo/journal") == 1


def test_a_full_disk_ends_the_bag_and_not_the_journal(journal, tmp_path, monkeypatch, caplog):
    sent = []
    publisher = SimpleNamespace(publish=lambda message: sent.extend(message.entries))
    monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: publisher)
    monkeypatch.setattr(journal_output, "wait_until_sent", lambda _: None)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(JournalBag, "write", full)
    output = journal_output.JournalOutput(journal, tmp_path / "run.bag")
    for name in ("first", "second"):
        with journal.command(name):
            pass
        output.end_bag()
    output.close()
    assert [each.name for each in sent] == ["first", "second"]
    assert not (tmp_path / "run.bag").exists()


def test_a_bag_in_no_folder_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="No such file"):
        JournalBag(tmp_path / "none" / "run.bag")


@pytest.fixture
def make_replay(sim, journal, tmp_path, monkeypatch):
    """Make a replay of a service's call, which a handler serves now."""

    def make(kind, handler, **call):
        fields = {"kind": JournalEntry.SERVICE, "type": kind._type, "md5sum": kind._md5sum, **call}
        path = written(tmp_path / "run.bag", entry(0, **START), entry(1, **fields))
        protocol = SimpleNamespace(recv_data_class=kind._request_class)
        service = SimpleNamespace(service_class=kind, protocol=protocol, handler=handler)
        manager = SimpleNamespace(get_service=lambda _: service)
        monkeypatch.setattr(replay, "get_service_manager", lambda: manager)
        steps = SimpleNamespace(series=0)
        node = SimpleNamespace(sim=sim, journal=journal, control=None, steps=steps)
        return replay.Replay(RecordedJournal(path), node, replay.Changes({}, ()), 9.0)

    return make


def test_a_handler_that_waits_for_what_comes_later_ends_the_replay(make_replay, monkeypatch):
    """It was served beside others in the recorded run; a replay serves one after the other."""
    later = threading.Event()
    monkeypatch.setattr(replay, "ENTRY_PATIENCE", 0.05)
    repeated = make_replay(Trigger, lambda _: later.wait(60.0), name="/hand/close", data=b"")
    repeated.run()
    later.set()
    assert "/hand/close was done, and now waits" in repeated.difference


def test_a_difference_for_want_of_a_package_is_none(make_replay, journal):
    request, name = io.BytesIO(), "/gazebo/spawn_urdf_model"
    SpawnModelRequest(model_xml="<mesh filename='package://my_arm/a.stl'/>").serialize(request)

    def refuse(_):
        with journal.command("spawn") as made:
            made.kind, made.name = JournalEntry.SERVICE, name
        return SpawnModelResponse(False, "there is no package my_arm")

    repeated = make_replay(SpawnModel, refuse, name=name, data=request.getvalue(), answer=7)
    with pytest.raises(NoRecording, match="package my_arm isn't found: ./ws --with"):
        repeated.run()


def test_a_replay_has_the_hashes_of_the_recorded_run(tmp_path, monkeypatch):
    """They decide the order of sets, as in users' plugins, and Python takes them at its start."""
    facts = json.dumps(FACTS | {"hashes": "7"}).encode()
    path = written(tmp_path / "run.bag", entry(0, data=facts), entry(1))
    started = []

    def start_again(*_):
        started.append(os.environ["PYTHONHASHSEED"])
        raise SystemExit

    monkeypatch.setenv("PYTHONHASHSEED", "0")
    monkeypatch.setattr(os, "execv", start_again)
    with pytest.raises(SystemExit):
        replay_command.main([str(path)])
    assert started == ["7"]
