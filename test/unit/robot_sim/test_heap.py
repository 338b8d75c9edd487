"""The C library's heap, as the C library tells of it."""

import pytest
from support.python import run_python

COUNT = """
import ctypes, threading
from robot_sim.heap import use_one_arena
{}
libc, done = ctypes.CDLL(None), threading.Barrier(5)

def allocate():
    libc.malloc(100)
    done.wait()

for _ in range(4):
    threading.Thread(target=allocate).start()
done.wait()
libc.fopen.restype = ctypes.c_void_p
file = ctypes.c_void_p(libc.fopen(b"/dev/stdout", b"w"))
libc.malloc_info(0, file)
libc.fclose(file)
"""


@pytest.mark.parametrize(("call", "one"), [("use_one_arena()", True), ("", False)])
def test_threads_share_one_arena_once_it_is_asked_for(call, one):
    assert (run_python(COUNT.format(call)).stdout.count("<heap nr=") == 1) == one
