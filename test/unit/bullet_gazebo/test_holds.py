"""Time that is held goes on, whatever happens to who holds it."""

import threading

import pytest

from bullet_gazebo.timing import FairLock, Holds


@pytest.fixture
def holds() -> Holds:
    return Holds(FairLock(), lambda: None)


def test_it_is_held_for_the_block_alone(holds: Holds) -> None:
    with holds.hold(60.0, lambda: None):
        assert holds
    with pytest.raises(ZeroDivisionError), holds.hold(60.0, lambda: None):
        raise ZeroDivisionError
    assert not holds


def test_where_no_thread_is_left_it_is_not_held_for_ever(holds: Holds, monkeypatch) -> None:
    def none_left(self: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", none_left)
    with pytest.raises(RuntimeError, match="can't start"), holds.hold(60.0, lambda: None):
        raise AssertionError("the block is not reached")
    assert not holds
    holds.await_end(threading.Event())


def test_who_holds_it_too_long_is_told(holds: Holds) -> None:
    late = threading.Event()
    with holds.hold(0.01, late.set):
        assert late.wait(30.0)
        assert not holds
