"""A world whose script's signals are handled in the middle of a call."""

import signal
import threading

import pytest
import rospy
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldResponse
from support.ros.ros_fakes import FakeMaster, FakeService, on_wire

from lockstep_runner import world as world_module
from lockstep_runner.world import RunsByItself, ScriptWorld, WorldFailed, is_running
from ros_calls import master as ros_master

ANSWER = AdvanceWorldResponse(success=True, time_step=0.001, ticks=1)


@pytest.fixture
def answers():
    """What the simulator of `world` does, one for each request; each returns the pieces that it sends."""
    return []


@pytest.fixture
def world(answers):
    master = FakeMaster()
    service = FakeService(lambda request: answers.pop(0)(), kind=AdvanceWorld)
    master.services[world_module.SERVICE] = service.address
    master.nodes[world_module.NODE] = master.uri
    with ros_master.using(master.uri):
        made = ScriptWorld()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(rospy.core, "is_initialized", lambda: True)
            assert made.look()
        yield made
        made.forget()
    service.close()
    master.close()


@pytest.fixture
def alarm(answers):
    """Has a signal come while the next request is answered, and its handler do something."""
    before = signal.getsignal(signal.SIGUSR1)

    def ring(handler):
        signal.signal(signal.SIGUSR1, handler)
        answers.append(lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGUSR1))

    yield ring
    signal.signal(signal.SIGUSR1, before)


@pytest.mark.parametrize("kind", [RuntimeError, TimeoutError, BlockingIOError, ConnectionError])
def test_what_a_handler_raises_is_the_scripts(world, alarm, answers, kind):
    def raises(*_):
        raise kind("the script's own")

    alarm(raises)
    with pytest.raises(kind, match="the script's own"):
        world.advance(1)
    answers.append(lambda: [on_wire(ANSWER)])
    assert world.advance(1).ticks == 1, "the next call has its own answer"


def test_a_simulator_that_hangs_is_not_the_scripts(world, answers, monkeypatch):
    monkeypatch.setattr(world._call, "timeout", 0.3)
    answers.append(lambda: None)
    with pytest.raises(WorldFailed, match=r"hangs: /gazebo/advance_world: no answer within 0.3 s"):
        world.advance(1)


def test_a_call_left_between_its_halves_is_given_up(world, answers, monkeypatch):
    call = world._call
    end, answered = call.end, threading.Event()

    def leave():
        assert answered.wait(60)  # otherwise the simulator may not have read the request
        monkeypatch.setattr(call, "end", end)
        raise ValueError("of a handler")

    def late():
        answered.set()
        return [on_wire(AdvanceWorldResponse(ticks=5))]

    monkeypatch.setattr(call, "end", leave)
    answers += [late, lambda: [on_wire(ANSWER)]]
    with pytest.raises(ValueError, match="of a handler"):
        world.advance(5)
    assert world.advance(1).ticks == 1


def test_a_simulator_that_has_just_started_is_not_taken_for_one_in_real_time(monkeypatch):
    there = set()

    def is_offered(service):  # all are registered right after somebody has asked for the first time
        before = service in there
        there.update((world_module.SERVICE, f"{world_module.NODE}/pause_physics"))
        return before

    monkeypatch.setattr(world_module, "is_offered", is_offered)
    monkeypatch.setattr(ros_master, "lives", lambda node: True)
    assert is_running()
    monkeypatch.setattr(world_module, "is_offered", lambda service: service != world_module.SERVICE)
    with pytest.raises(RunsByItself):
        is_running()
