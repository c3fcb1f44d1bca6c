"""The wide depth of the running rig: fuses every fixation, compares with the live view, draws, stores."""

import logging
import queue
import threading
import time
from collections.abc import Callable
from contextvars import copy_context
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, FoveaError
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.attention.look_around import LookAroundProgress, LookedAround, look_around
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.ply import ply_bytes
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.values import Fixation
from foveacam_pipeline.wide_depth.looks import fuse_fixation
from foveacam_pipeline.wide_depth.rendering import (
    backdrop_mesh,
    context_cloud,
    context_mesh,
    context_picture,
    without_specks,
)
from foveacam_pipeline.wide_depth.values import ContextMap, DepthSource
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.watching.flows import PANE, count_flow, this_part
from foveacam_server.resources.looking.wide_depth.context_keeper import ContextKeeper
from foveacam_server.resources.looking.wide_depth.schema import WideDepthDocument
from foveacam_server.rig.encoder import eight_bit
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import SceneViewer
from foveacam_server.rig.view_state import ViewPicture

KIND = "wide_depth_survey"
URL = "/api/v1/wide_depth"
VIEW = "wide_depth"
COMPARE_S = 1.0
"""Interval at which the live wide view is compared with the cells' stored appearance."""
SHOW_EVERY = 2
"""Comparisons between two redraws of a changed context: 2 s."""
SAVE_EVERY = 15
WAITING = 2
"""Length of the queue of looks to be fused; when it is full, the oldest is dropped."""
LEAST_SHARE_CHANGE = 0.005
"""Change of the share of known cells at which an event is emitted."""
DEPTH_DIGITS, SHARE_DIGITS = 4, 5
PERCENT = 100
"""Steps of a look around's progress: the number of its looks is not known before its end."""

_log = logging.getLogger(__name__)
PART, LOOKS = "foveacam-wide-depth", "looks"
"""Name of the thread, and of the flow of looks into its queue."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WideDepthTools:
    """Services and devices that the wide depth needs."""

    hardware: HardwareThread
    calibration: Callable[[], Calibration]
    """The calibration in force; raises where there is none."""
    jobs: JobRunner
    hub: FrameHub
    viewer: SceneViewer | None
    events: EventLog
    clock: Clock


class WideDepthService:
    """Holds the wide context: the `DepthContext` of fixations, and a resource of REST."""

    def __init__(self, keeper: ContextKeeper, tools: WideDepthTools) -> None:
        self._keeper = keeper
        self._tools = tools
        self._looks: queue.Queue[Callable[[], None]] = queue.Queue()
        self._survey_id: str | None = None
        self._surveyed: float | None = None
        self._shown: tuple[WideContext | None, int] = (None, -1)
        self._emitted_share = 0.0
        self._turns = 0
        self._compared: ViewPicture | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=PART, daemon=True)
        tools.jobs.handle(KIND, self._survey)

    def start(self) -> None:
        """Start the thread that fuses looks and watches the live view."""
        self._thread.start()

    def close(self) -> None:
        """End the thread and store the context."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)
        self._keeper.save()

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        """Return the samples within `reach_tan` (tangent units) of a direction: (2,) tangents."""
        context = self._keeper.present()
        return DepthSamples.none() if context is None else context.around(target, reach_tan=reach_tan)

    def add(self, fixation: Fixation, calibration: Calibration) -> None:
        """Queue a fixation, verged or not, to be fused; never blocks."""
        if fixation.sighting is None:
            return
        while self._looks.qsize() >= WAITING:
            try:
                self._looks.get_nowait()
            except queue.Empty:
                break
            count_flow(this_part(), PART, LOOKS, passed=0, dropped=1)
        count_flow(this_part(), PART, LOOKS)
        work = partial(copy_context().run, self._fuse, fixation, calibration)  # keeps the job's ids in spans
        self._looks.put(work)

    def look_around(self, *, idempotency_key: str | None = None) -> Job:
        """Queue a look around; raise at once where it cannot be made now."""
        self._tools.calibration()
        self._tools.hardware.check_may_move()
        job = self._tools.jobs.submit(KIND, idempotency_key=idempotency_key)
        self._survey_id = job.id
        return job

    def document(self) -> WideDepthDocument:
        """Return the figures of the wide depth."""
        context = self._require()
        waiting = None if self._survey_id is None else self._tools.jobs.get(self._survey_id)
        job_id = None if waiting is None or waiting.state.ended else waiting.id
        return _summary(
            context.snapshot(), context, surveyed_fraction=self._surveyed, survey_job_id=job_id, url=URL
        )

    def picture(self) -> NDArray[np.uint8]:
        """Return depth as colours, (h, w, 3) uint8 RGB, with a scale."""
        return context_picture(without_specks(self._require().snapshot()))

    def ply(self) -> bytes:
        """Return all points with their standard errors; raise `NotFound` where there are none."""
        context = self._require()
        cloud = context_cloud(context.snapshot(), self._wide_picture(), context.wide)
        if len(cloud) == 0:
            raise NotFound(
                "nothing is known of the wide view's depth",
                asked="points of the wide depth",
                found="no cell has a depth",
                remedy="look around first: POST /api/v1/wide_depth/surveys",
            )
        return ply_bytes(cloud)

    def forget(self) -> None:
        """Forget the wide depth, including the stored context."""
        self._keeper.forget()
        self._surveyed = None
        self._show()

    def _require(self) -> WideContext:
        calibration = self._tools.calibration()
        return self._keeper.present() or WideContext(calibration.wide)  # nothing is known while the rig moves

    def _survey(self, job: JobContext) -> str:
        calibration, context = self._tools.calibration(), self._require()

        def on_look(made: LookAroundProgress) -> None:
            note = f"look {made.look.index}. {made.look.look.reason}"
            job.progress(round(PERCENT * made.done), total=PERCENT, note=note)

        holder, before = f"look around {job.job.id}", self._tools.hardware.pose
        with self._tools.hardware.session(holder, cancelled=job.cancelled) as head:
            looked = look_around(
                head,
                calibration,
                context,
                clock=self._tools.clock,
                on_look=on_look,
                cancelled=job.cancelled,
            )
            if before is not None and not looked.cancelled:
                head.look(before)  # the eyes look where they looked, and at one place
        self._surveyed = looked.shown_fraction
        self._keeper.save()
        self._show(bring=True)
        self._emit_change(always=True)
        ended = _describe_survey(looked)
        self._tools.events.emit("wide_depth.surveyed", ended, data=self.document())
        job.check()
        return URL

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                self._turn()
            except FoveaError as error:
                _log.debug("wide depth: %s", error)
            except Exception:  # noqa: BLE001 - the thread's outermost frame: the next turn may do
                _log.exception("wide depth: a turn failed")

    def _turn(self) -> None:
        try:
            fuse = self._looks.get(timeout=COMPARE_S)
        except queue.Empty:
            pass
        else:
            fuse()
            return
        context, newest = self._keeper.present(), self._tools.hub.newest("wide")
        if context is None or newest is None:
            return
        if newest is not self._compared:  # without viewers, wide pictures are rare
            context.detect_changes(gray(_eight_bit_rgb(newest)))
            self._compared = newest
        self._turns += 1
        if self._turns % SHOW_EVERY == 0:
            self._show()
        if self._turns % SAVE_EVERY == 0:
            self._keeper.save()

    def _fuse(self, fixation: Fixation, calibration: Calibration) -> None:
        context = self._keeper.present()
        if context is not None and context.wide == calibration.wide:
            with span("wide depth"):
                fuse_fixation(context, fixation, calibration)

    def _show(self, *, bring: bool = False) -> None:
        """Redraw the 3D pane and the view if the context has changed."""
        context = self._keeper.present()
        if context is None or ((context, context.revision) == self._shown and not bring):
            return
        self._shown = (context, context.revision)
        known = without_specks(context.snapshot())
        picture = self._wide_picture()
        self._tools.hub.publish_picture(VIEW, context_picture(known), t_ns=self._tools.clock.now_ns())
        if self._tools.viewer is not None and picture is not None:
            self._show_surface(known, picture, context, bring=bring)
        self._emit_change()

    def _show_surface(
        self, known: ContextMap, picture: NDArray[np.uint8], context: WideContext, *, bring: bool
    ) -> None:
        viewer = self._tools.viewer
        if viewer is None:
            return
        mesh = context_mesh(known, picture, context.wide)
        backdrop = backdrop_mesh(known, picture, context.wide)
        if backdrop is None:
            viewer.remove_surroundings()
        else:
            count_flow(this_part(), PANE, "drawings")
            viewer.show_surroundings(mesh, backdrop, bring=bring)

    def _emit_change(self, *, always: bool = False) -> None:
        document = self.document()
        if not always and abs(document.known_fraction - self._emitted_share) < LEAST_SHARE_CHANGE:
            return
        self._emitted_share = document.known_fraction
        self._tools.events.emit("wide_depth.changed", "the wide depth has changed", data=document)

    def _wide_picture(self) -> NDArray[np.uint8] | None:
        """Return the newest wide picture, (h, w, 3) uint8 RGB."""
        newest = self._tools.hub.newest("wide")
        return None if newest is None else _eight_bit_rgb(newest)


def _eight_bit_rgb(picture: ViewPicture) -> NDArray[np.uint8]:
    image = eight_bit(picture.image, bits=picture.bits)
    if image.ndim == 3:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), dtype=np.uint8)


def _describe_survey(looked: LookedAround) -> str:
    ended = "was cancelled after" if looked.cancelled else "took"
    return (
        f"the look around {ended} {looked.duration_s:.0f} s: {looked.looks} looks showed "
        f"{PERCENT * looked.shown_fraction:.0f} % of the field"
    )


def _summary(
    known: ContextMap,
    context: WideContext,
    *,
    surveyed_fraction: float | None,
    survey_job_id: str | None,
    url: str,
) -> WideDepthDocument:
    """Return the document of a snapshot of `context`."""
    at = known.known[0]
    q, age_s = known.inverse_z_per_m[0][at], time.time() - known.measured_s[0][at]
    source = known.source[0][at]
    cells = len(q)
    return WideDepthDocument(
        columns=context.columns,
        rows=context.rows,
        cell_px=context.cell_px,
        known_cells=cells,
        known_fraction=round(cells / at.size, SHARE_DIGITS),
        sources={each.name.lower(): int(np.count_nonzero(source == each)) for each in DepthSource},
        nearest_m=_quantile(1.0 / q, 0.05, DEPTH_DIGITS),
        farthest_m=_quantile(1.0 / q, 0.95, DEPTH_DIGITS),
        relative_sigma_median=_quantile(known.sigma_per_m[0][at] / q, 0.5, SHARE_DIGITS + 1),
        age_median_s=_quantile(age_s, 0.5, 1),
        oldest_s=_quantile(age_s, 1.0, 1),
        surveyed_fraction=None if surveyed_fraction is None else round(surveyed_fraction, SHARE_DIGITS),
        survey_job_id=survey_job_id,
        png_url=f"{url}.png",
        ply_url=f"{url}.ply",
    )


def _quantile(values: NDArray[np.float64], share: float, digits: int) -> float | None:
    return None if len(values) == 0 else round(float(np.quantile(values, share)), digits)
