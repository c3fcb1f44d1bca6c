"""Arenas of the allocator: threads that come and go leave no memory behind."""

import os
import subprocess
import sys

PROGRAM = """
import re, sys, threading
from foveacam_server.doors.process_limits import bound_arenas

if sys.argv[1] == "bounded":
    bound_arenas()
together = threading.Barrier(12)

def work():
    kept = [bytearray(4096) for _ in range(2000)]
    together.wait()  # all threads live at once, each with an arena of its own where it may
    del kept

threads = [threading.Thread(target=work) for _ in range(12)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
import ctypes
libc = ctypes.CDLL("libc.so.6")
libc.malloc_stats()
"""


def arenas(mode: str) -> int:
    """Return how many arenas the allocator of a program with twelve threads has."""
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, mode],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
        env={name: value for name, value in os.environ.items() if name != "MALLOC_ARENA_MAX"},
    )
    return found.stderr.count("Arena ")


def test_many_threads_share_two_arenas() -> None:
    assert arenas("bounded") <= 2 < arenas("unbounded")
