# Written by .ci/generate_client.py; do not edit.
"""Waits for a job or a point cloud: by the events of the server; where those cannot be had, by polling.

Written from `async_job_waiting.py`.
"""

from collections.abc import Callable
from contextlib import closing

from foveacam_client.generated.transport import SILENCE_S, Transport
from foveacam_client.problems import ProblemError, Unreachable
from foveacam_client.retries import Absence
from foveacam_client.server_sent import EventReader
from foveacam_client.waiting import Deadline, Watch

POLL_S = 1.0
"""Polling interval."""


class JobWaiting:
    """Waits until a watch has ended; `reconnect_s`: how long a server may be away meanwhile."""

    def __init__(self, transport: Transport, *, reconnect_s: float, pause: Callable[[float], None]) -> None:
        self._transport = transport
        self._reconnect_s = reconnect_s
        self._pause = pause

    def until_ended(self, watch: Watch, ask: Callable[[], None], deadline: Deadline) -> None:
        """Wait for something by events; where those fail, by polling once a second."""
        try:
            reader = EventReader(self._transport.newest_event_id())
            ask()
            if not watch.ended:
                self._process_events(watch, reader, deadline)
        except (Unreachable, ProblemError):
            pass  # polling finds out whether that lasts
        absence = Absence(self._reconnect_s)
        while not watch.ended:
            self._pause(deadline.left_s(POLL_S))
            try:
                ask()
                absence.end()
            except Unreachable:
                if absence.over:
                    raise

    def _process_events(self, watch: Watch, reader: EventReader, deadline: Deadline) -> None:
        """Process events until the wait is over or the connection ends."""
        listening = self._transport.listen(reader, silence_s=deadline.left_s(SILENCE_S))
        with closing(listening) as events:
            for event in events:
                watch.process(event)
                if watch.ended:
                    return
                deadline.left_s(SILENCE_S)
