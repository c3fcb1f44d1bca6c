"""Ctrl-C for work that has worker processes: this program alone hears it, and may end well."""

import _thread
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_POLL_S = 0.1


@contextmanager
def heard_ctrl_c(on_first: Callable[[], None]) -> Iterator[None]:
    """Call `on_first` at the first Ctrl-C; the next raises KeyboardInterrupt. On the main thread only.

    A terminal sends Ctrl-C to worker processes too, which would die of it amid their work. They inherit which
    signals are blocked: it is blocked here, and a thread waits for it.
    """
    pressed = 0

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        nonlocal pressed
        pressed += 1
        if pressed > 1:
            raise KeyboardInterrupt
        on_first()

    over = threading.Event()
    handler = signal.signal(signal.SIGINT, interrupt)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    listener = threading.Thread(target=_listen, args=(over,), name="ctrl-c", daemon=True)
    listener.start()
    try:
        yield
    finally:
        over.set()
        listener.join()
        signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _listen(over: threading.Event) -> None:
    """Pass a blocked Ctrl-C on to the main thread's handler."""
    while not over.is_set():
        if signal.sigtimedwait({signal.SIGINT}, _POLL_S) is not None:
            _thread.interrupt_main()
