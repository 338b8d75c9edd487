"""The lock serves its waiters in turn; held time goes on, whatever happens to its holder."""

import threading

import pytest

from robot_sim.timing import FairLock, Holds

BOUND = 60.0  # [s]


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


def test_the_lock_is_handed_on_in_the_order_of_asking():
    lock, order, waiting = FairLock(), [], []

    def take(name):
        waiting.append(name)
        with lock:
            order.append(name)

    with lock:
        threads = []
        for name in range(5):
            threads.append(threading.Thread(target=take, args=(name,)))
            threads[-1].start()
            while len(lock._waiting) <= name:  # the thread has queued up
                threading.Event().wait(0.001)
    for thread in threads:
        thread.join(BOUND)
    assert order == [0, 1, 2, 3, 4]


def test_a_busy_simulation_does_not_keep_others_out():
    lock, done = FairLock(), threading.Event()

    def spin():
        while not done.is_set():
            with lock:
                pass

    thread = threading.Thread(target=spin)
    thread.start()
    for _ in range(100):
        with lock:
            pass
    done.set()
    thread.join(BOUND)
    assert not thread.is_alive()


def test_a_lent_lock_serves_those_who_only_look_and_then_goes_back():
    lock, order = FairLock(), []
    looked = threading.Event()

    def change():
        with lock:
            order.append("changed")

    def look():
        with lock.glance():
            order.append("looked")
        looked.set()

    threads = [threading.Thread(target=change), threading.Thread(target=look)]
    with lock:
        mine = lock.holder
        for count, thread in enumerate(threads):  # the change asks first
            thread.start()
            while len(lock._waiting) <= count:
                threading.Event().wait(0.001)
        with lock.lent():
            assert looked.wait(BOUND)
            assert lock.holder is None
            with lock.glance():
                order.append("looked again")
        assert lock.holder == mine
        order.append("went on")
    for thread in threads:
        thread.join(BOUND)
    assert order == ["looked", "looked again", "went on", "changed"]
