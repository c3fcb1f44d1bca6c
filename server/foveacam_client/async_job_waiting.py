"""Waits for a job or a point cloud: by the events of the server; where those cannot be had, by polling.

`generated/job_waiting.py` is this module without `await`.
"""

from collections.abc import Awaitable, Callable
from contextlib import aclosing

from foveacam_client.async_transport import SILENCE_S, AsyncTransport
from foveacam_client.problems import ProblemError, Unreachable
from foveacam_client.retries import Absence
from foveacam_client.server_sent import EventReader
from foveacam_client.waiting import Deadline, Watch

POLL_S = 1.0
"""Polling interval."""


class AsyncJobWaiting:
    """Waits until a watch has ended; `reconnect_s`: how long a server may be away meanwhile."""

    def __init__(
        self, transport: AsyncTransport, *, reconnect_s: float, pause: Callable[[float], Awaitable[None]]
    ) -> None:
        self._transport = transport
        self._reconnect_s = reconnect_s
        self._pause = pause

    async def until_ended(self, watch: Watch, ask: Callable[[], Awaitable[None]], deadline: Deadline) -> None:
        """Wait for something by events; where those fail, by polling once a second."""
        try:
            reader = EventReader(await self._transport.newest_event_id())
            await ask()
            if not watch.ended:
                await self._process_events(watch, reader, deadline)
        except (Unreachable, ProblemError):
            pass  # polling finds out whether that lasts
        absence = Absence(self._reconnect_s)
        while not watch.ended:
            await self._pause(deadline.left_s(POLL_S))
            try:
                await ask()
                absence.end()
            except Unreachable:
                if absence.over:
                    raise

    async def _process_events(self, watch: Watch, reader: EventReader, deadline: Deadline) -> None:
        """Process events until the wait is over or the connection ends."""
        listening = self._transport.listen(reader, silence_s=deadline.left_s(SILENCE_S))
        async with aclosing(listening) as events:
            async for event in events:
                watch.process(event)
                if watch.ended:
                    return
                deadline.left_s(SILENCE_S)
