"""What the replaced functions share: when it speaks, when it ends the script, and whom it waits for."""

import os
import threading
import time

import pytest
import rospy
from support.ros.lockstep_world import MS

from lockstep_runner import originals
from lockstep_runner.runner import watch
from lockstep_runner.triggers import Triggers
from lockstep_runner.world import WorldFailed, WorldGone

BOUND = 30.0  # [s of wall time]


def until_told(capsys, text):
    said, deadline = "", time.monotonic() + BOUND
    while text not in said and time.monotonic() < deadline:
        originals.sleep(0.01)
        said += capsys.readouterr().err
    return said


def test_a_busy_loop_is_told_of_once_with_what_may_be_named(runner, capsys):
    runner.triggers.called("/gazebo/get_world_properties")
    runner.triggers.after("/chatter", is_command=False)
    thread = watch(runner, 0.1)
    said = until_told(capsys, "--step-on")
    originals.join(thread, BOUND)
    assert said.count("\n") == 1
    assert "no simulated time has passed for 0.1 s" in said
    assert "--step-on /gazebo/get_world_properties or /chatter" in said


def test_a_trigger_that_isn_t_there_is_told_with_it(runner, capsys):
    runner.triggers = Triggers(["/nope"])
    watch(runner, 0.1)
    assert "It uses nothing of the name /nope." in until_told(capsys, "--step-on")


@pytest.mark.parametrize("state", ["paused", "waiting", "alone"])
def test_nothing_is_told_where_time_needn_t_pass(runner, capsys, monkeypatch, state):
    if state == "paused":
        runner.world.paused = True
    elif state == "waiting":
        runner.clock.driving = True
    else:
        runner.world.there = False
    thread = watch(runner, 0.05)
    originals.sleep(0.3)  # several times the bound
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(rospy.core, "_shutdown_flag", True)
    originals.join(thread, BOUND)
    assert not thread.is_alive()


@pytest.mark.parametrize("ctrl_c", [False, True])
def test_a_world_that_ends_leaves_waits_to_the_wall_and_is_told_once_but_at_ctrl_c(
    runner, capsys, monkeypatch, ctrl_c
):
    def gone():
        monkeypatch.setattr(rospy.core, "_shutdown_flag", ctrl_c)
        raise WorldGone("the simulator has been ended")

    runner.world.exchanged = gone
    for _ in range(1 if ctrl_c else 2):  # what follows the end is wall time
        assert not runner.wait(1.0)
    said = capsys.readouterr().err
    assert said == "" if ctrl_c else said.count("sleeps are wall time") == 1


@pytest.fixture
def ended(runner, monkeypatch):
    """Exit codes of a script whose simulator has died."""

    def died():
        raise WorldFailed("the simulator has died")

    codes = []

    def leave(code):
        codes.append(code)
        raise SystemExit(code)

    monkeypatch.setattr(os, "_exit", leave)
    runner.world.exchanged = died
    return codes


def test_a_world_that_dies_ends_the_script_also_where_it_catches_everything(runner, capsys, ended):
    with pytest.raises(SystemExit):
        runner.wait(1.0)
    assert ended == []
    with pytest.raises(SystemExit):  # the script has caught the first one
        runner.wait(1.0)
    assert ended == [1]
    assert capsys.readouterr().err == "lockstep: the simulator has died\n"


def test_a_world_that_dies_in_another_thread_ends_the_script(runner, capsys, monkeypatch, ended):
    """Else the script waits in wall time for what never comes."""
    thread = threading.Thread(target=runner.called, args=("/gazebo/reset_world", bytes))
    thread.start()
    originals.join(thread, BOUND)
    runner.world.exchanged, runner.world.there = lambda: None, False
    monkeypatch.setattr(rospy.core, "_shutdown_flag", True)
    runner.before_publishing("/command")
    with pytest.raises(SystemExit):
        runner.is_connected()
    assert ended == []
    with pytest.raises(SystemExit):  # the script has caught the first one
        runner.before_call("/gazebo/reset_world")
    assert ended == [1]
    assert capsys.readouterr().err == "lockstep: the simulator has died\n"


@pytest.mark.parametrize(("step", "passes"), [(3, 9), (10, 10), (8, 8), (1, 8)])
def test_a_period_is_rounded_up_to_whole_steps_which_is_told_once(runner, capsys, step, passes):
    runner.world.step = step * MS
    runner.world.there = False

    def look():
        runner.world.there = True
        return True

    runner.world.look = look
    runner.topics.changed = lambda: None
    for _ in range(2):
        runner.world.there = False
        assert runner.is_connected()
    runner.triggers = Triggers(["/gazebo/reset_world"])
    runner.called("/gazebo/reset_world", bytes)
    assert runner.clock.passed == passes * MS
    said = capsys.readouterr().err
    assert said.count("\n") == (passes != 8)
    if said:
        assert f"--dt 0.008 is rounded up to {passes / 1000:g} s" in said


def test_who_looks_for_another_node_in_vain_gets_messages_and_then_time(runner):
    looks = 0
    while runner.waits_for_others(0.5):
        looks += 1
        assert runner.clock.passed == 0
        assert looks < 10
    assert looks == 4  # 2 s of looking
    assert set(runner.world.calls) == {0}


def test_the_end_waits_for_threads_that_still_want_time(runner):
    thread = threading.Thread(target=lambda: runner.wait(0.05))
    go = threading.Lock()
    with go:
        thread.run = lambda: (go.acquire(), runner.wait(0.05))
        originals.start(thread)
        runner.clock.began(thread)
    runner.finish([thread])
    assert runner.clock.passed >= 50 * MS and not thread.is_alive()


@pytest.mark.parametrize("passes", [True, False])
def test_pauses_go_with_the_next_call(runner, passes):
    name = "unpause_physics" if passes else "pause_physics"
    assert runner.switches(f"/gazebo/{name}")
    assert runner.world.paused is not passes
    assert not runner.switches("/other/pause_physics")
