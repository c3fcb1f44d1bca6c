"""What keeps the interpreter from the event loop and the stop: computing threads, garbage collection."""

import gc
import sys

import anyio.to_thread

REQUEST_THREADS = 6
"""Of the framework's 40, each that computes makes the event loop wait its turn: 200 ms with all of them."""
SWITCH_S = 0.001
"""Python's default is 5 ms: what the event loop and the stop wait for each thread that computes."""


def bound_threads() -> None:
    """Bound the threads of this event loop's requests; called on the loop."""
    anyio.to_thread.current_default_thread_limiter().total_tokens = REQUEST_THREADS
    sys.setswitchinterval(SWITCH_S)


def keep_start_objects() -> None:
    """Take what exists now out of garbage collection; called once the rig is open.

    A full collection holds up every thread: 0.2 to 0.4 s for the 290 000 objects of a started server,
    all of which stay until it ends.
    """
    gc.collect()
    gc.freeze()
