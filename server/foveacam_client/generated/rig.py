# Written by .ci/generate_client.py; do not edit.
"""A rig behind a server: all operations, and shortcuts for the most common tasks.

Written from `async_rig.py`.
"""

from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import sleep
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

import httpx

from foveacam_client.call import Call, ResultT, StartedJob
from foveacam_client.clouds import PointCloud
from foveacam_client.connection import Connection
from foveacam_client.generated import models
from foveacam_client.generated.lease import held_lease
from foveacam_client.generated.operations import Operations
from foveacam_client.generated.transport import SILENCE_S, Transport
from foveacam_client.pictures import decode_picture
from foveacam_client.problems import ProblemError, Unreachable
from foveacam_client.retries import Absence
from foveacam_client.server_sent import EventReader
from foveacam_client.waiting import CloudWatch, Deadline, EstimateWatch, JobWatch, OnProgress, Watch

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STOP = Call("POST", "/api/v1/stop", idempotent=True)  # idempotent: a second stop has no effect
POLL_S = 1.0
"""Polling interval."""
RECENT_EVENTS = 200
"""Number of past events searched for earlier estimates of a fixation."""
RENEWAL_S = 4.0
"""Timeout of one renewal of a lease, which lasts 15 s."""


class Rig:
    """A rig; `api`: all operations of the server, by noun. Close it, or use it as a context."""

    def __init__(
        self,
        connection: Connection,
        *,
        http_transport: httpx.BaseTransport | None = None,
        pause: Callable[[float], None] = sleep,
    ) -> None:
        self._connect = partial(Transport, http_transport=http_transport, pause=pause)
        self._connection = connection
        self._transport = self._connect(connection)
        self._pause = pause
        self._reconnect_s = connection.retries.reconnect_s
        self.api = Operations(self._transport)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close all connections."""
        self._transport.close()

    def stop(self) -> models.StopAnswer:
        """Park the mirrors, cancel all jobs, and refuse all moves until `api.stop.release()`.

        It uses a separate connection, which the server answers however busy it is.
        """
        own = self._connect(self._connection)
        try:
            return own.answer(_STOP, models.StopAnswer)
        finally:
            own.close()

    @contextmanager
    def hold_lease(
        self, holder: str, *, take_over: bool = False, reason: str | None = None
    ) -> Iterator[None]:
        """Hold the control lease during the block, in which nobody else can move the rig.

        `holder`: name shown to others. `take_over`: also from another holder; from another person with a
        `reason`. Raise `RigBusy` where another holds it; `LeaseLost` in the block's calls, and at its end,
        once it was taken over or has ended, as it does when nothing moved for ten minutes.
        """
        request = models.LeaseRequest(holder=holder, take_over=take_over, reason=reason)
        own = self._connect(replace(self._connection, timeout_s=min(RENEWAL_S, self._connection.timeout_s)))
        try:
            with held_lease(self._transport, own, request):
                yield
        finally:
            own.close()

    def use_lease(self, token: str | None) -> None:
        """Send the token of a lease from `api.lease.take` with every call; None: no longer.

        The lease expires 15 s after `api.lease.renew`; `hold_lease` does all of this.
        """
        self._transport.lease_token = token

    def fixate(
        self,
        x_px: float,
        y_px: float,
        *,
        label: str | None = None,
        timeout_s: float | None = None,
        on_progress: OnProgress | None = None,
        cancel_on_interrupt: bool = False,
    ) -> models.FixationDocument:
        """Point both foveae at a pixel of the wide view, wait, and return the distance with its error."""
        request = models.FixationRequest(pixel=models.Pixel(x_px=x_px, y_px=y_px))
        if label is not None:
            request.label = label
        return self.wait(
            self.api.fixations.create(request),
            timeout_s=timeout_s,
            on_progress=on_progress,
            cancel_on_interrupt=cancel_on_interrupt,
        )

    def estimates(
        self, started: StartedJob[models.FixationDocument]
    ) -> Generator[models.FixationEstimate, None]:
        """Yield the estimates of a fixation's distance while it runs, at most one per look.

        The first one may come before the first look. It ends with the fixation; `wait` returns the answer.
        """
        watch = EstimateWatch(started.id)
        recent = self.api.events.recent(limit=RECENT_EVENTS)
        for event in recent:
            if estimate := watch.process(event):
                yield estimate
        if not watch.has_ended():
            watch.update(self.api.jobs.get(started.id))
        if watch.has_ended():
            return
        last_id = recent[-1].id if recent else 0
        with closing(self._transport.events(last_event_id=last_id)) as events:
            for event in events:
                if estimate := watch.process(event):
                    yield estimate
                if watch.has_ended():
                    return

    def cloud(self, fixation: models.FixationDocument, *, timeout_s: float = 30.0) -> PointCloud:
        """Return the point cloud of a fixation, which is computed after its answer."""
        watch = CloudWatch(fixation)

        def ask() -> None:
            watch.cloud_id = (self.api.fixations.get(fixation.id)).cloud_id

        late = f"fixation {fixation.id} ({fixation.state}) has no point cloud; a measured distance gives one"
        if not watch.ended:
            self._follow(watch, ask, Deadline(timeout_s, late=late))
        return PointCloud(self.api.clouds.ply(str(watch.cloud_id)).read())

    def frame(
        self, view: str = "wide", *, scale: Literal["1", "2", "4"] = "1"
    ) -> "NDArray[Any]":  # Any: dtype of the view
        """Return the newest picture of a live view: (h, w) or (h, w, 3) uint8, RGB; by OpenCV."""
        return decode_picture(self.api.views.snapshot(view, scale=scale).read())

    def capture(
        self,
        name: str,
        *,
        plan: models.RasterPlan | None = None,
        timeout_s: float | None = None,
        on_progress: OnProgress | None = None,
        cancel_on_interrupt: bool = False,
    ) -> models.CaptureDocument:
        """Capture a raster as a dataset and wait for it; without a plan, over the whole field."""
        request = models.CaptureRequest(name=name)
        if plan is not None:
            request.plan = plan
        return self.wait(
            self.api.captures.create(request),
            timeout_s=timeout_s,
            on_progress=on_progress,
            cancel_on_interrupt=cancel_on_interrupt,
        )

    def datasets(self, text: str | None = None) -> list[models.CaptureDocument]:
        """Return the captured datasets whose name or label contains `text`."""
        return self.api.captures.list(text=text)

    def download_dataset(self, capture_id: str, path: Path | str) -> Path:
        """Write a dataset to a ZIP file, which appears when it is complete; return its path."""
        return self.api.captures.download(capture_id).save(path)

    def events(
        self, *, kinds: Collection[str] | None = None, last_event_id: int | None = None
    ) -> Generator[models.EventDocument, None]:
        """Yield events endlessly; `last_event_id`: first those after it.

        A broken connection is opened again, without a loss of events.
        """
        with closing(self._transport.events(last_event_id=last_event_id)) as events:
            for event in events:
                if kinds is None or event.kind in kinds:
                    yield event

    def wait(
        self,
        started: StartedJob[ResultT],
        *,
        timeout_s: float | None = None,
        on_progress: OnProgress | None = None,
        cancel_on_interrupt: bool = False,
    ) -> ResultT:
        """Wait for a job and return its result, or raise its problem.

        `cancel_on_interrupt`: an interrupt also cancels the job; otherwise it continues on the server.
        """
        watch = JobWatch(started.id, on_progress=on_progress)

        def ask() -> None:
            watch.update(self.api.jobs.get(started.id))

        late = f"job {started.id} goes on; wait longer, or cancel it"
        try:
            self._follow(watch, ask, Deadline(timeout_s, late=late))
        except KeyboardInterrupt:
            if cancel_on_interrupt:
                self.api.jobs.cancel(started.id)
            raise
        return self._transport.answer(Call("GET", watch.result_url()), started.result)

    def _follow(self, watch: Watch, ask: Callable[[], None], deadline: Deadline) -> None:
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
