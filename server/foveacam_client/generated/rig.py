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
from foveacam_client.fixation_result import FixationResult
from foveacam_client.generated import models
from foveacam_client.generated.following import Following
from foveacam_client.generated.job_waiting import JobWaiting
from foveacam_client.generated.lease import held_lease
from foveacam_client.generated.operations import Operations
from foveacam_client.generated.remote_dataset import RemoteDataset
from foveacam_client.generated.transport import Transport
from foveacam_client.pictures import decode_picture
from foveacam_client.requests import raster_request, recording_request
from foveacam_client.server_source import ServerSource
from foveacam_client.waiting import CloudWatch, Deadline, EstimateWatch, JobWatch, OnProgress

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STOP = Call("POST", "/api/v1/stop", idempotent=True)  # idempotent: a second stop has no effect
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
        self._source = ServerSource(connection)
        self._transport = self._connect(connection)
        self._waiting = JobWaiting(self._transport, reconnect_s=connection.retries.reconnect_s, pause=pause)
        self.api = Operations(self._transport)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._connection.url!r})"

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
    ) -> FixationResult:
        """Point both foveae at a pixel of the wide view, wait, and return the distance with its error."""
        request = models.FixationRequest(pixel=models.Pixel(x_px=x_px, y_px=y_px))
        if label is not None:
            request.label = label
        started = self.api.fixations.create(request)
        found = self.wait(
            StartedJob(started.job, FixationResult),
            timeout_s=timeout_s,
            on_progress=on_progress,
            cancel_on_interrupt=cancel_on_interrupt,
        )
        return found.read_from(self._source)

    def fixation(self, fixation: models.FixationDocument | str) -> FixationResult:
        """Return an earlier fixation, by its document or id, as a notebook shows it."""
        found = self.api.fixations.get(fixation if isinstance(fixation, str) else fixation.id)
        return FixationResult.model_validate(found, from_attributes=True).read_from(self._source)

    def follow(
        self, x_px: float, y_px: float, *, label: str | None = None, priority: float = 1.0
    ) -> Following:
        """Follow the target at a pixel of the wide view until `stop()`, or the end of a block.

        `priority`: how often it is looked at, compared with other followed targets, 0.1 to 10.
        """
        request = models.FollowRequest(pixel=models.Pixel(x_px=x_px, y_px=y_px), priority=priority)
        if label is not None:
            request.label = label
        return Following(self.api, self.api.follows.create(request))

    def look_around(
        self,
        *,
        timeout_s: float | None = None,
        on_progress: OnProgress | None = None,
        cancel_on_interrupt: bool = False,
    ) -> models.WideDepthDocument:
        """Look over the whole field, wait, and return the figures of the wide depth.

        What was found stays when it is cancelled; `api.wide_depth.ply()` has its points.
        """
        return self.wait(
            self.api.wide_depth.look_around(),
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
            self._waiting.until_ended(watch, ask, Deadline(timeout_s, late=late))
        cloud_id = str(watch.cloud_id)
        return PointCloud(self.api.clouds.ply(cloud_id).read(), cloud_id, self._source)

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

    def raster(
        self,
        *,
        columns: int = 9,
        rows: int = 9,
        name: str | None = None,
        distance_m: float | None = None,
        timeout_s: float | None = None,
        on_progress: OnProgress | None = None,
        cancel_on_interrupt: bool = False,
    ) -> models.CaptureDocument:
        """Capture a raster over the whole field as a dataset and wait for it.

        `name`: else the time. `distance_m`: at which both foveae meet; None: measured at the start.
        """
        request = raster_request(columns=columns, rows=rows, name=name, distance_m=distance_m)
        return self.wait(
            self.api.captures.create(request),
            timeout_s=timeout_s,
            on_progress=on_progress,
            cancel_on_interrupt=cancel_on_interrupt,
        )

    def record(
        self,
        name: str | None = None,
        *,
        seconds: float | None = None,
        timeout_s: float | None = None,
        on_progress: OnProgress | None = None,
        cancel_on_interrupt: bool = False,
    ) -> models.RecordingDocument:
        """Record all cameras for so many seconds and wait for it; without `seconds`, begin and return.

        Then `stop_recording` ends it, or the server after 300 s. `name`: else `recording` with a number.
        """
        started = self.api.recordings.create(recording_request(name, duration_s=seconds))
        if seconds is None:
            for found in self.api.recordings.list():
                if found.job_id == started.id:
                    return found
        return self.wait(  # without seconds: it has failed already
            started, timeout_s=timeout_s, on_progress=on_progress, cancel_on_interrupt=cancel_on_interrupt
        )

    def stop_recording(self, recording: models.RecordingDocument | str) -> models.RecordingDocument:
        """End a recording, by what `record` returned or its id; return it when its file is complete."""
        return self.api.recordings.stop(recording if isinstance(recording, str) else recording.id)

    def dataset(
        self, capture: models.CaptureDocument | str, *, cameras: Collection[str] | None = None
    ) -> RemoteDataset:
        """Return a captured dataset, by its document or id, to be read point by point.

        `cameras`: those whose pictures are read, of left, right and wide; None: all.
        """
        capture_id = capture if isinstance(capture, str) else capture.id
        return RemoteDataset(
            self.api,
            self._connection,
            capture=self.api.captures.get(capture_id),
            points=self.api.captures.points(capture_id),
            cameras=cameras,
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
            self._waiting.until_ended(watch, ask, Deadline(timeout_s, late=late))
        except KeyboardInterrupt:
            if cancel_on_interrupt:
                self.api.jobs.cancel(started.id)
            raise
        return self._transport.answer(Call("GET", watch.result_url()), started.result)
