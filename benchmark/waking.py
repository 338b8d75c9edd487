#!/usr/bin/env python3
"""What it costs to wake a process that sleeps on another core, against one that polls.

    ./ws python3 benchmark/waking.py

Two processes on two cores send each other a byte, each after it has computed for as long as a simulator or
its client does. In a virtual machine waking may take many times as long as on bare metal; it is what polling
before sleeping can spare, twice a step (benchmark/polling.py).
"""

import os
import socket
import statistics
import time
from collections.abc import Iterator

WORK = 50e-6  # [s]
TRIPS = 1000


def measured() -> float:
    """The time [s] from a message until its receiver goes on, beyond that of one that polls."""
    first, second, *_ = sorted(os.sched_getaffinity(0))
    asleep, awake = (statistics.median(trips(first, second, polls)) for polls in (False, True))
    return max(0.0, asleep - awake) / 2.0


def trips(own: int, others: int, polls: bool) -> Iterator[float]:
    """Times [s] from request to answer of a process on another core."""
    here, there = socket.socketpair()
    with here:
        child = os.fork()
        if not child:
            try:
                here.close()
                os.sched_setaffinity(0, {others})
                answer(there, polls)
            finally:
                os._exit(0)
        there.close()
        cores = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {own})
        try:
            for _ in range(TRIPS):
                compute()
                begin = time.perf_counter()
                here.send(b"?")
                receive(here, polls)
                yield time.perf_counter() - begin
        finally:
            os.sched_setaffinity(0, cores)
    os.waitpid(child, 0)


def answer(end: socket.socket, polls: bool) -> None:
    """Answers until the other side has gone."""
    while receive(end, polls):
        compute()
        end.send(b"!")


def receive(end: socket.socket, polls: bool) -> bytes:
    """Waits for a byte; none is the end."""
    end.setblocking(not polls)
    while True:
        try:
            return end.recv(1)
        except BlockingIOError:
            continue


def compute() -> None:
    """Takes up the core for a while."""
    end = time.perf_counter() + WORK
    while time.perf_counter() < end:
        pass


if __name__ == "__main__":
    print(f"waking a process takes {1e6 * measured():.1f} us more than one that polls")
