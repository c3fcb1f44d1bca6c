# Written by .ci/generate_client.py; do not edit.
"""Sends calls, with retries where allowed, and reads answers, files and events.

Written from `async_transport.py`.
"""

from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager
from itertools import count
from pathlib import Path
from time import sleep

import httpx

from foveacam_client.answers import AnswerT, read_answer
from foveacam_client.call import Call, ResultT, StartedJob
from foveacam_client.connection import Connection
from foveacam_client.generated import models
from foveacam_client.part_file import PartFile
from foveacam_client.problems import (
    ClientError,
    DeviceFailed,
    DeviceMissing,
    LeaseLost,
    TooManyRequests,
    Unreachable,
    error_of_answer,
)
from foveacam_client.retries import Absence
from foveacam_client.server_sent import EventReader

STREAM = Call("GET", "/api/v1/events")
_NEWEST = Call("GET", "/api/v1/events/recent", query={"limit": 1})
SILENCE_S = 25.0
"""Read timeout of a stream of events, in which the server sends something every 10 s."""
BLOCK_BYTES = 1 << 16


class Transport:
    """One connection pool to one server."""

    def __init__(
        self,
        connection: Connection,
        *,
        http_transport: httpx.BaseTransport | None = None,
        pause: Callable[[float], None] = sleep,
    ) -> None:
        self._retries = connection.retries
        self._url = connection.base_url
        self._pause = pause
        self._http = httpx.Client(
            base_url=self._url,
            headers=connection.headers,
            verify=connection.verify,
            timeout=connection.timeout_s,
            trust_env=False,
            transport=http_transport,
        )
        self.lease_token: str | None = None
        """Token of the control lease, sent with every call."""
        self.lease_lost: ClientError | None = None
        """Why the lease is lost, which every call then raises."""

    def close(self) -> None:
        """Close all connections."""
        self._http.close()

    def check_lease(self) -> None:
        """Raise `LeaseLost` where the lease is lost."""
        if self.lease_lost is not None:
            raise LeaseLost(str(self.lease_lost)) from self.lease_lost

    def answer(self, call: Call, kind: type[AnswerT]) -> AnswerT:
        """Send a call and return the document of its answer."""
        answer = self._send(call)
        return read_answer(answer, kind)

    def start(self, call: Call, kind: type[ResultT]) -> StartedJob[ResultT]:
        """Send a call and return the job that it starts."""
        return StartedJob(self.answer(call, models.JobDocument), kind)

    def order(self, call: Call) -> None:
        """Send a call whose answer is empty."""
        self._send(call)

    def download(self, call: Call) -> "Download":
        """Return the file of a call, which is requested when it is read."""
        return Download(self, call)

    def content(self, call: Call) -> bytes:
        """Send a call and return the bytes of its answer."""
        return (self._send(call)).content

    def chunks(self, call: Call) -> Generator[bytes, None]:
        """Send a call and yield the bytes of its answer as they arrive."""
        with self._opened(call) as answer:
            try:
                for block in answer.iter_bytes(BLOCK_BYTES):
                    yield block
            except httpx.TransportError as error:
                raise self._unreachable(error) from error

    def save(self, call: Call, path: Path) -> None:
        """Write a call's answer to a file, renamed when complete; start again if the connection breaks."""
        for attempt in count(1):
            try:
                with PartFile(path) as file, closing(self.chunks(call)) as blocks:
                    for block in blocks:
                        file.write(block)
                return
            except Unreachable:
                pause_s = self._retries.pause_s(call, attempt=attempt, answer=None)
                if pause_s is None:
                    raise
                self._pause(pause_s)

    def events(
        self, call: Call = STREAM, *, last_event_id: int | None
    ) -> Generator[models.EventDocument, None]:
        """Yield events endlessly, first those after `last_event_id`; a broken stream is opened again."""
        if last_event_id is None:
            last_event_id = self.newest_event_id()
        reader = EventReader(last_event_id)
        attempt, absence = 0, Absence(self._retries.reconnect_s)
        while True:
            try:
                with closing(self.listen(reader, call)) as stream:
                    for event in stream:
                        attempt = 0
                        absence.end()
                        if event is not None:
                            yield event
            except (Unreachable, TooManyRequests, DeviceFailed, DeviceMissing):
                if absence.over:
                    raise
            attempt += 1
            self._pause(self._retries.back_off_s(attempt))

    def newest_event_id(self) -> int:
        """Return the id of the newest event; 0 without one."""
        newest = self.answer(_NEWEST, list[models.EventDocument])
        return newest[-1].id if newest else 0

    def listen(
        self, reader: EventReader, call: Call = STREAM, *, silence_s: float = SILENCE_S
    ) -> Generator[models.EventDocument | None, None]:
        """Yield events from one connection, and None for anything else received, until it ends."""
        reader.forget_line()
        with self._opened(call, headers=reader.headers, silence_s=silence_s) as answer:
            try:
                for line in answer.iter_lines():
                    yield reader.read(line)
            except httpx.TransportError as error:
                raise self._unreachable(error) from error

    @contextmanager
    def _opened(
        self, call: Call, *, headers: dict[str, str] | None = None, silence_s: float | None = None
    ) -> Iterator[httpx.Response]:
        answer = self._send(call, headers=headers, silence_s=silence_s, stream=True)
        try:
            yield answer
        finally:
            answer.close()

    def _send(
        self,
        call: Call,
        *,
        headers: dict[str, str] | None = None,
        silence_s: float | None = None,
        stream: bool = False,
    ) -> httpx.Response:
        self.check_lease()
        request = self._request(call, headers=headers or {}, silence_s=silence_s)
        attempt, opening_s = 1, 0.0
        while True:
            try:
                answer = self._http.send(request, stream=stream)
            except httpx.TransportError as error:
                pause_s = self._retries.pause_s(call, attempt=attempt, answer=None)
                if pause_s is None:
                    raise self._unreachable(error) from error
            else:
                if answer.is_success or answer.status_code in call.also:
                    return answer
                answer.read()
                refusal = error_of_answer(answer)
                pause_s = self._retries.opening_pause_s(refusal, waited_s=opening_s)
                if pause_s is not None:
                    opening_s += pause_s
                    attempt = 0
                else:
                    pause_s = self._retries.pause_s(call, attempt=attempt, answer=answer)
                if pause_s is None:
                    raise refusal
            attempt += 1
            self._pause(pause_s)

    def _request(self, call: Call, *, headers: dict[str, str], silence_s: float | None) -> httpx.Request:
        lease = {} if self.lease_token is None else {"X-Lease": self.lease_token}
        wait_s = self._http.timeout
        return self._http.build_request(
            call.method,
            call.address,
            params=call.set_query or None,
            json=call.json_body,
            content=call.content,
            headers={**lease, **call.headers(), **headers},
            timeout=wait_s if silence_s is None else httpx.Timeout(wait_s.connect, read=silence_s),
        )

    def _unreachable(self, error: Exception) -> ClientError:
        why = str(error) or type(error).__name__
        return Unreachable(
            f"{self._url}: no server answers ({why}); is the server running, and is the address right?"
            " `foveacam serve` starts one."
        )


class Download:
    """A file of the server, which is requested when it is read."""

    def __init__(self, transport: Transport, call: Call) -> None:
        self._transport = transport
        self._call = call

    def read(self) -> bytes:
        """Return its bytes."""
        return self._transport.content(self._call)

    def text(self) -> str:
        """Return it as text."""
        return (self.read()).decode("utf-8")

    def chunks(self) -> Generator[bytes, None]:
        """Yield its bytes as they arrive."""
        return self._transport.chunks(self._call)

    def save(self, path: Path | str) -> Path:
        """Write it to a file, which appears when it is complete; return the file's path."""
        place = Path(path)
        self._transport.save(self._call, place)
        return place
