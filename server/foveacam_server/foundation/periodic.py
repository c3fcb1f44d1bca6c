"""A thread that repeats work at an interval until it is closed; a failure does not end it."""

import logging
import threading
from collections.abc import Callable

from foveacam_hardware.contract import FoveaError

_log = logging.getLogger(__name__)


class PeriodicThread:
    """Calls `work` every `period_s`; an error is logged, once while it repeats, and the calls continue.

    `name`: of the thread, shown in logs and among the server's parts. `level`: of the log line of a
    `FoveaError`; any other error is logged with its traceback. `at_close`: whether `work` is called once more
    at the end.
    """

    def __init__(
        self,
        name: str,
        work: Callable[[], object],
        *,
        period_s: float,
        level: int = logging.WARNING,
        at_close: bool = False,
    ) -> None:
        self._work, self._period_s, self._level, self._at_close = work, period_s, level, at_close
        self._logged: str | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Start the thread; the first call is after one period."""
        self._thread.start()

    def close(self) -> None:
        """End the thread after a call in progress; no effect when it never ran."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._closing.wait(self._period_s):
            self._attempt()
        if self._at_close:
            self._attempt()

    def _attempt(self) -> None:
        try:
            self._work()
        except Exception as error:  # noqa: BLE001 - the thread's outermost frame: the next call may succeed
            self._log(error)
        else:
            self._logged = None

    def _log(self, error: Exception) -> None:
        text = f"{type(error).__name__}: {error}"
        if text == self._logged:
            return
        self._logged = text
        if isinstance(error, FoveaError):
            _log.log(self._level, "%s: %s", self._thread.name, error)
        else:
            _log.error("%s failed", self._thread.name, exc_info=error)
