"""Sends live pictures to many clients, by WebSocket and by MJPEG, within limits.

Each client has its own task and gets only the newest picture, so that none waits for another.
"""

import asyncio
import time
from collections import Counter
from collections.abc import AsyncGenerator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Protocol

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.persons.person_quota import Places
from foveacam_server.foundation.watching.flows import ENCODER, VIEWERS, count_flow
from foveacam_server.rig import stream_messages as messages
from foveacam_server.rig.encoder import EncodedPicture, JpegStore, Scale
from foveacam_server.rig.frame_hub import FrameHub, ViewSubscription
from foveacam_server.rig.stream_credit import CreditBook
from foveacam_server.rig.view_state import ViewPicture

MAX_CLIENTS, CLIENTS_EACH = 64, 16
"""Largest number of connections of live views, of all persons and of one."""
MAX_MJPEG, MJPEG_EACH = 32, 2
"""A browser opens six connections per host: six MJPEG images block every request, including the stop."""
STATS_INTERVAL_S = 1.0
OLD_MS, FRESH_WITHIN_S = 1500.0, 1.0
"""Age from which a snapshot waits for the next picture, and the longest wait."""
_ENCODER_THREADS = 2


class MessageStream(Protocol):
    """A text and binary message stream to one client (a WebSocket)."""

    async def send_text(self, data: str) -> None:
        """Send one text message, waiting while the connection is full."""
        ...

    async def send_bytes(self, data: bytes) -> None:
        """Send one binary message, waiting while the connection is full."""
        ...

    async def receive_text(self) -> str:
        """Return the next text message; raise when the client is disconnected."""
        ...


class LiveStreams:
    """The encoder shared by all clients, and the limits of clients."""

    def __init__(self, hub: FrameHub, *, boot_id: str, max_clients: int = MAX_CLIENTS) -> None:
        self.hub = hub
        self.boot_id = boot_id
        self.seats = Places(
            "connections of live views",
            most=max_clients,
            most_each=CLIENTS_EACH,
            remedy="close a page",
        )
        self.mjpeg_seats = Places(
            "MJPEG streams",
            most=MAX_MJPEG,
            most_each=MJPEG_EACH,
            remedy="close one, or use the WebSocket /api/v1/views/ws, which carries all views",
        )
        self._executor = ThreadPoolExecutor(_ENCODER_THREADS, thread_name_prefix=ENCODER)
        self.jpegs = JpegStore(hub, executor=self._executor)
        self.frames_sent = 0
        self.bytes_sent = 0
        self.sent: Counter[str] = Counter()
        """Pictures sent, by view."""
        self.dropped: Counter[str] = Counter()
        """Pictures that a client missed because a newer one came first, by view."""
        self._ended = False
        self._waiting: set[asyncio.Event] = set()

    @property
    def clients(self) -> int:
        """Number of clients of the WebSocket."""
        return self.seats.taken

    def count_sent(self, picture: ViewPicture, *, before: ViewPicture | None, size_bytes: int) -> None:
        """Count a picture sent to a client; `before`: the previous one of this client."""
        self.frames_sent += 1
        self.bytes_sent += size_bytes
        self.sent[picture.view] += 1
        dropped = 0 if before is None else picture.number - before.number - 1
        self.dropped[picture.view] += dropped
        count_flow(ENCODER, VIEWERS, "pictures", dropped=dropped, size_bytes=size_bytes)

    async def snapshot(self, view: str, scale: Scale) -> EncodedPicture | None:
        """Return the newest picture of a view, or the next one where that is old; None before the first.

        Cameras deliver few pictures without viewers.
        """
        age_ms = self.hub.status(view).age_ms
        if age_ms is not None and age_ms > OLD_MS:
            fresh = asyncio.Event()
            watch = self.hub.watch(frozenset({view}), lambda _view: fresh.set())
            try:
                with suppress(TimeoutError):
                    await asyncio.wait_for(fresh.wait(), FRESH_WITHIN_S)
            finally:
                watch.close()
        return await self.jpegs.newest(view, scale)

    async def pictures(self, view: str, scale: Scale) -> AsyncGenerator[EncodedPicture]:
        """Yield each newest picture of `view`, until the server ends."""
        fresh = asyncio.Event()
        self._waiting.add(fresh)
        watch = self.hub.watch(frozenset({view}), lambda _view: fresh.set())
        try:
            last = None
            while not self._ended:
                encoded = await self.jpegs.newest(view, scale)
                if encoded is not None and encoded.picture is not last:
                    self.count_sent(encoded.picture, before=last, size_bytes=len(encoded.jpeg))
                    last = encoded.picture
                    yield encoded
                if self.hub.newest(view) is last:
                    await fresh.wait()
                fresh.clear()
        finally:
            watch.close()
            self._waiting.discard(fresh)

    def end(self) -> None:
        """End all MJPEG streams; called on the event loop when the server shuts down."""
        self._ended = True
        for fresh in self._waiting:
            fresh.set()

    def close(self) -> None:
        """End the encoder's threads."""
        self._executor.shutdown(wait=True, cancel_futures=True)


class StreamSession:
    """Serves one client of the views' WebSocket."""

    def __init__(self, streams: LiveStreams, wire: MessageStream) -> None:
        self._streams = streams
        self._hub = streams.hub
        self._wire = wire
        self._credit = CreditBook()
        self._watch: ViewSubscription | None = None
        self._wakeup = asyncio.Event()
        self._problems: list[str] = []

    async def run(self) -> None:
        """Serve the client until it disconnects; the error that `wire` then raises is propagated."""
        await self._wire.send_text(messages.hello(self._hub, boot_id=self._streams.boot_id))
        tasks = [asyncio.create_task(self._listen()), asyncio.create_task(self._feed())]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            if self._watch is not None:
                self._watch.close()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _listen(self) -> None:
        while True:
            text = await self._wire.receive_text()
            try:
                self._handle(messages.parse(text))
            except InvalidInput as error:
                # Sent by the single sending task; only the last of several is sent
                self._problems = [messages.problem(str(error))]
            self._wakeup.set()

    def _handle(self, message: messages.Subscribe | messages.Ack) -> None:
        if isinstance(message, messages.Ack):
            names = self._hub.names
            if message.view >= len(names):
                raise InvalidInput(f"ack: view is 0 to {len(names) - 1}, found {message.view}")
            self._credit.acknowledge(names[message.view], seq=message.seq, now_ns=time.monotonic_ns())
            return
        watch = self._hub.watch(frozenset(message.views), lambda _view: self._wakeup.set())
        if self._watch is not None:
            self._watch.close()
        self._watch = watch
        self._credit.subscribe({view: choice.scale for view, choice in message.views.items()})

    async def _feed(self) -> None:
        next_stats_s = 0.0
        while True:
            self._wakeup.clear()
            while self._problems:
                await self._wire.send_text(self._problems.pop())
            if time.monotonic() >= next_stats_s:
                await self._wire.send_text(messages.stats(self._hub))
                next_stats_s = time.monotonic() + STATS_INTERVAL_S
            if not await self._send_due():
                await self._pause(next_stats_s - time.monotonic())

    async def _pause(self, wait_s: float) -> None:
        try:
            async with asyncio.timeout(max(wait_s, 0.0)):
                await self._wakeup.wait()
        except TimeoutError:
            return  # time for the statistics

    async def _send_due(self) -> bool:
        """Send the picture that is due; return whether there was one."""
        newest = {view: self._hub.newest(view) for view in self._credit.views}
        view = self._credit.due({name: picture for name, picture in newest.items() if picture is not None})
        scale = None if view is None else self._credit.scale(view)
        if view is None or scale is None:
            return False
        encoded = await self._streams.jpegs.newest(view, scale)
        if encoded is None or self._credit.scale(view) != scale:
            return True  # the subscription has changed meanwhile: try again
        picture, before = encoded.picture, self._credit.last(view)
        self._credit.sent(picture, seq=messages.wire_seq(picture.seq), now_ns=time.monotonic_ns())
        overlay = messages.overlay(picture)
        if overlay is not None:
            await self._wire.send_text(overlay)
        data = messages.frame(encoded, self._hub)
        await self._wire.send_bytes(data)
        self._streams.count_sent(picture, before=before, size_bytes=len(data))
        return True
