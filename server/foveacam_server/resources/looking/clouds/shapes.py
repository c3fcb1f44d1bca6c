"""Computes depth, pictures, cloud and mesh of a fixation's last look on a separate thread.

The fixation's answer does not wait for them. A job that needs the shape calls `make` on its own thread.
"""

import logging
import queue
import threading
from collections.abc import Callable, Sequence
from contextvars import copy_context
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import FoveaError, Role, Sighting
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.measure.look import look_depth
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import cloud as cloud_of
from foveacam_pipeline.stereo.depth import depth_map
from foveacam_pipeline.stereo.estimator import MatchedPair
from foveacam_pipeline.stereo.flat_picture import flat_picture
from foveacam_pipeline.stereo.mesh import depth_mesh
from foveacam_pipeline.stereo.pictures import anaglyph, depth_picture, difference
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.values import Cloud, DepthMesh, RectifiedPair
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.values import Basis
from foveacam_pipeline.wide_depth.wide_matches import eye_matches
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.watching import timings
from foveacam_server.foundation.watching.flows import PANE, count_flow, this_part
from foveacam_server.resources.looking.clouds.collection import CloudCollection, FixationShape
from foveacam_server.resources.looking.clouds.depth_patches import project_patch, samples_patch
from foveacam_server.resources.looking.clouds.schema import CloudDocument, CloudFailure, TargetCloud
from foveacam_server.rig.ports import PictureSink, SceneViewer
from foveacam_web.scene_values import FixationDrawing, LimitsDrawing

_log = logging.getLogger(__name__)

PART, LOOKS = "foveacam-shapes", "looks"
"""Name of the thread, and of the flow of looks into its queue."""
CLOUD_CREATED = "cloud.created"
"""Kind of the event emitted after a fixation's new cloud was stored."""
WAITING = 4
"""Length of the queue; when it is full, the oldest fixation is dropped for the newer one."""
PUT_BACK = 12
"""Number of fixations of an earlier run, newest first, that are drawn again in the 3D pane at the start."""
MAX_POINTS = 50_000
MESH_STEP_PX = 4
SCALE, FULL_SCALE = 0.5, 1.0
"""Scales of the rectified windows: of ordinary looks, and of those at full resolution."""


class PairMatcher(Protocol):
    """Computes the disparities of a pair by the chosen backend."""

    def estimate(self, pair: RectifiedPair) -> MatchedPair:
        """Return the disparities with the name of the backend that computed them."""
        ...


def _unchecked() -> None:
    """Do nothing: the default `check`, which never ends the work."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VergedLook:
    """A verged fixation whose shape is to be computed."""

    fixation_id: str
    drawing: FixationDrawing
    """Its drawing in the 3D pane, without cloud and mesh."""
    sighting: Sighting
    calibration: Calibration
    target_id: str | None
    """Id of its target; None without one."""
    eye: Role = Role.LEFT
    """The fovea whose picture is drawn at the target's depth where the pair gives no shape."""
    scale: float = SCALE
    """Pixels of the depth map per pixel of the sensor; `FULL_SCALE` needs frames at binning 1."""

    @property
    def most_points(self) -> int:
        """Largest number of points of the cloud, in proportion to the pixels of the depth map."""
        return round(MAX_POINTS * (self.scale / SCALE) ** 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundedLook:
    """A fixation with only limits of its distance."""

    fixation_id: str
    drawing: LimitsDrawing


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredLook:
    """A fixation of an earlier run with a known distance; `cloud_id`: None without a cloud."""

    fixation_id: str
    drawing: FixationDrawing
    cloud_id: str | None


class ShapeWorker:
    """Turns verged looks into pictures, stored clouds and drawings in the 3D pane, on one thread."""

    def __init__(
        self,
        *,
        clouds: CloudCollection,
        matcher: PairMatcher,
        sink: PictureSink,
        viewer: SceneViewer | None,
        events: EventLog,
    ) -> None:
        self._clouds = clouds
        self._matcher = matcher
        self._sink = sink
        self._viewer = viewer
        self._events = events
        self._earlier: tuple[StoredLook | BoundedLook, ...] = ()
        self._waiting: queue.Queue[Callable[[], None] | None] = queue.Queue()
        self.dropped = 0
        self._thread = threading.Thread(target=self._run, name=PART, daemon=True)

    def start(self) -> None:
        """Start the thread, which first draws the fixations of an earlier run."""
        self._thread.start()

    def put_back(self, looks: Sequence[StoredLook | BoundedLook]) -> None:
        """Set the fixations of an earlier run, oldest first, to draw at the start; call before `start`."""
        self._earlier = tuple(looks[-PUT_BACK:])

    def close(self) -> None:
        """Drop the fixations that wait and end the thread."""
        while self._drop_one():
            pass
        self._waiting.put(None)
        if self._thread.is_alive():
            self._thread.join(timeout=10.0)

    def put(self, seen: VergedLook | BoundedLook) -> None:
        """Queue a fixation; never blocks."""
        while self._waiting.qsize() >= WAITING and self._drop_one():
            self.dropped += 1
            count_flow(this_part(), PART, LOOKS, passed=0, dropped=1)
        work = partial(self._show_limits, seen) if isinstance(seen, BoundedLook) else partial(self._try, seen)
        count_flow(this_part(), PART, LOOKS)
        self._waiting.put(partial(copy_context().run, work))  # keeps the job's ids in logs and spans

    def forget(self, fixation_id: str) -> None:
        """Remove a fixation from the 3D pane."""
        if self._viewer is not None:
            self._viewer.remove_fixation(fixation_id)

    def _drop_one(self) -> bool:
        try:
            self._waiting.get_nowait()
        except queue.Empty:
            return False
        return True

    def _run(self) -> None:
        for earlier in self._earlier:
            if isinstance(earlier, BoundedLook):
                self._show_limits(earlier)
            else:
                self._show_again(earlier)
        while (work := self._waiting.get()) is not None:
            work()

    def _try(self, seen: VergedLook) -> None:
        try:
            with span("shape"):
                self._work(seen)
        except Exception:  # noqa: BLE001 - the thread's outermost frame: the next fixation gets its shape
            _log.exception("no shape for %s", seen.fixation_id)
            self._failed(seen, "an unexpected error; the cause is in the server's log")

    def _work(self, seen: VergedLook) -> None:
        if seen.drawing.basis is Basis.FOVEA_AND_WIDE:  # only one eye sees it: no pair to match
            self._work_without_pair(seen, (seen.eye,))
            return
        try:
            self.make(seen)
        except FoveaError as error:
            self._failed(seen, str(error))
            self._work_without_pair(seen, EYES)

    def make(self, seen: VergedLook, *, check: Callable[[], None] = _unchecked) -> CloudDocument:
        """Compute the shape of a look, store and show it; raise `NotFound` where nothing matches.

        `check`: called between its parts; raises to end the work before anything is stored.
        """
        pair = rectify(seen.sighting, seen.calibration, scale=seen.scale)
        self._publish("anaglyph", anaglyph(pair), t_ns=pair.t_ns)
        self._publish("difference", difference(pair), t_ns=pair.t_ns)
        with timings.DEPTH.time(), span("depth"):
            matched = self._matcher.estimate(pair)
        check()
        shape = fixation_shape(seen, pair, matched)
        check()
        cloud = self._clouds.put(shape)  # stored before it is shown, so that it can be measured at once
        self._publish("depth", shape.depth_picture, t_ns=pair.t_ns)
        self._show(seen, cloud=shape.cloud, mesh=shape.mesh if len(shape.mesh.faces) else None)
        self._events.emit(
            CLOUD_CREATED,
            f"{seen.drawing.label}: {cloud.points} points",
            data=TargetCloud(**dict(cloud), target_id=seen.target_id),
        )
        return cloud

    def _publish(self, view: str, picture: NDArray[np.uint8], *, t_ns: int) -> None:
        """Publish a picture of a fixation unless the view shows live pictures now."""
        if not self._sink.watched(view):
            self._sink.publish_picture(view, picture, t_ns=t_ns)

    def _show(self, seen: VergedLook | StoredLook, *, cloud: Cloud | None, mesh: DepthMesh | None) -> None:
        if self._viewer is None:
            return
        count_flow(this_part(), PANE, "drawings")
        self._viewer.show_fixation(seen.fixation_id, replace(seen.drawing, cloud=cloud, mesh=mesh))

    def _work_without_pair(self, seen: VergedLook, eyes: Sequence[Role]) -> None:
        """Draw what the look's `eye` saw as a flat picture at the target's depth, and keep coarse depths.

        `eyes`: those whose view is matched with the wide one.
        """
        sighting, z_m = seen.sighting, seen.drawing.point_rig_m[2]
        frame = sighting.left if seen.eye is Role.LEFT else sighting.right
        mesh = flat_picture(frame, seen.eye, sighting.volts, seen.calibration, z_m=z_m)
        self._show(seen, cloud=None, mesh=mesh)
        coarse = DepthSamples.none()
        for eye in eyes:
            coarse = coarse.joined(eye_matches(sighting, seen.calibration, eye, about_per_m=1.0 / z_m))
        patch = samples_patch(
            coarse, wide=seen.calibration.wide, fixation_id=seen.fixation_id, created_utc=utc_now()
        )
        if patch is not None:
            self._clouds.patches.add_coarse(patch)

    def _show_limits(self, seen: BoundedLook) -> None:
        if self._viewer is not None:
            self._viewer.show_limits(seen.fixation_id, seen.drawing)

    def _show_again(self, look: StoredLook) -> None:
        if self._viewer is None:
            return
        try:
            cloud = None if look.cloud_id is None else self._clouds.points(look.cloud_id)
        except (FoveaError, OSError, ValueError) as error:
            _log.warning("%s: its cloud cannot be read: %s", look.drawing.label, error)
            cloud = None
        self._show(look, cloud=cloud, mesh=None)

    def _failed(self, seen: VergedLook, reason: str) -> None:
        self._events.emit(
            "cloud.failed",
            f"{seen.drawing.label}: no shape: {reason}",
            level=EventLevel.WARNING,
            data=CloudFailure(fixation_id=seen.fixation_id, detail=reason),
        )


def fixation_shape(seen: VergedLook, pair: RectifiedPair, matched: MatchedPair) -> FixationShape:
    """Return the shape of a look from its pair and disparities; raise `NotFound` where nothing matched."""
    depth = depth_map(pair, matched.disparity)
    cloud = cloud_of(pair, depth, max_points=seen.most_points)
    if len(cloud) == 0:
        raise NotFound("no pixel of the last look could be matched between the foveae")
    patch = project_patch(
        pair, depth, wide=seen.calibration.wide, fixation_id=seen.fixation_id, created_utc=utc_now()
    )
    return FixationShape(
        fixation_id=seen.fixation_id,
        cloud=cloud,
        mesh=depth_mesh(pair, depth, step_px=MESH_STEP_PX),
        depth_picture=depth_picture(depth),
        backend=matched.backend,
        network_sha256=matched.sha256,
        look_size=_size_px(seen.sighting.left.image),
        depth_size=_size_px(depth.z_m),
        patch=patch,
        look=look_depth(
            pair, depth, calibration=seen.calibration, volts=seen.sighting.volts, scale=seen.scale
        ),
    )


def _size_px(image: NDArray[Any]) -> tuple[int, int]:  # Any: any bit depth
    height, width = image.shape[:2]
    return int(width), int(height)
