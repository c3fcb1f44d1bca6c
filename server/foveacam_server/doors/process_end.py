"""Ends the process in time after SIGINT or SIGTERM, whatever still runs in it.

The mirrors are parked at once, on a separate thread. Services are closed elsewhere meanwhile. At the deadline
a thread that nothing can block ends the process; a timer in C does so where no Python runs.
"""

import contextlib
import faulthandler
import logging
import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import FrameType

_log = logging.getLogger(__name__)

END_S = 3.5
"""Deadline after the first signal, at which the process ends in any case."""
LAST_S = 4.2
"""Deadline of the timer in C, for a computation that never releases the interpreter and so stops all Python
threads."""
CLOSED_S = 2.0
"""Longest time for the end of idle threads and the interpreter, once all services are closed."""
RESERVE_S = 0.4
"""Part of the time to the deadline that services may not use."""
UNCLEAN = 1
"""Exit status when something did not end in time; 0: everything ended by itself."""
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def start_exit_timer(after_s: float) -> None:
    """End the process after `after_s`, by a thread that needs no Python interpreter."""
    silent = Path(os.devnull).open("w")  # noqa: SIM115 - written to when the timer fires
    faulthandler.dump_traceback_later(after_s, exit=True, file=silent)


class ProcessEnd:
    """The end of this process; it begins once, with the first signal or by `begin`."""

    def __init__(
        self,
        *,
        on_begin: Callable[[], None],
        exit_now: Callable[[int], object] = os._exit,
        start_timer: Callable[[float], object] = start_exit_timer,
    ) -> None:
        """`on_begin`: brings the rig to rest; called on a separate thread."""
        self._on_begin = on_begin
        self._exit_now = exit_now
        self._start_timer = start_timer
        self._lock = threading.Lock()
        self._deadline_s: float | None = None
        self._closed = threading.Event()
        self._unended: list[str] = []
        """Services that did not close in time."""

    @property
    def begun(self) -> bool:
        """Whether the process is ending."""
        return self._deadline_s is not None

    def left_s(self) -> float:
        """Return the time left for closing services."""
        if self._deadline_s is None:
            return END_S - RESERVE_S
        return self._deadline_s - RESERVE_S - time.monotonic()

    def begin(self) -> None:
        """Begin the end, unless it has begun."""
        with self._lock:
            if self.begun:
                return
            self._start_timer(LAST_S)
            self._deadline_s = time.monotonic() + END_S
        threading.Thread(target=self._on_begin, name="foveacam-park", daemon=True).start()
        threading.Thread(target=self._end_at_deadline, name="foveacam-end", daemon=True).start()

    def closed(self, unended: Sequence[str]) -> None:
        """Record that the services are closed, and which did not end: there is nothing else to wait for."""
        self._unended.extend(unended)
        self._closed.set()

    def _end_at_deadline(self) -> None:
        deadline_s = self._deadline_s or 0.0
        if self._closed.wait(deadline_s - time.monotonic()):
            threading.Event().wait(min(CLOSED_S, deadline_s - time.monotonic()))  # this call ends the process
        self._end_now([] if self._closed.is_set() else ["requests and services"])

    def finish(self) -> None:
        """End the process at once if a service did not close in time: it may block the interpreter's exit."""
        if self._unended:
            self._end_now([])

    def _end_now(self, further: Sequence[str]) -> None:
        """End the process; log in one line what did not end in time."""
        running = [f"thread {thread.name}" for thread in threading.enumerate() if _is_waited_for(thread)]
        names = ", ".join([*self._unended, *further, *running])
        _log.error("the process ends now; not ended in time: %s", names)
        self._exit_now(UNCLEAN)

    @contextlib.contextmanager
    def signals(self, on_signal: Callable[[], None]) -> Iterator[None]:
        """Begin the end with the first SIGINT or SIGTERM, and call `on_signal`; ignore further ones.

        The interpreter writes each signal to a socket at once, also while the main thread is busy; a thread
        reads it. Once a signal came, further ones stay ignored: the process is ending.
        """
        if threading.current_thread() is not threading.main_thread():
            yield  # only the main thread can set signal handlers
            return
        written, read = socket.socketpair()
        written.setblocking(False)
        before_fd = signal.set_wakeup_fd(written.fileno(), warn_on_full_buffer=False)

        def noted(_number: int, _frame: FrameType | None) -> None:
            on_signal()

        before = {number: signal.signal(number, noted) for number in _SIGNALS}
        reader = threading.Thread(target=self._read_signals, args=(read,), daemon=True)
        reader.start()
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, signal.SIG_IGN if self.begun else handler)
            signal.set_wakeup_fd(before_fd)
            written.close()
            reader.join()
            read.close()

    def _read_signals(self, read: socket.socket) -> None:
        while numbers := read.recv(64):
            if any(number in _SIGNALS for number in numbers):
                self.begin()


def _is_waited_for(thread: threading.Thread) -> bool:
    """Return whether the interpreter waits for a thread before it ends."""
    return not thread.daemon and thread is not threading.main_thread()
