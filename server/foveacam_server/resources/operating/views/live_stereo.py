"""Makes anaglyph, difference and depth of the foveae's newest pair, and the wide view at their scale.

Each is computed only while it has viewers.
"""

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, FoveaError, Frame, Role, StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import depth_map, rgb
from foveacam_pipeline.stereo.estimator import BACKENDS
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.pictures import (
    AnaglyphStyle,
    anaglyph,
    depth_picture,
    depth_span,
    difference,
)
from foveacam_pipeline.stereo.rectify import halved, rectify_frames, to_uint8
from foveacam_pipeline.stereo.values import DisparityMap, RectifiedPair
from foveacam_pipeline.verge.matching.wide_patch import wide_zoom
from foveacam_server.rig.frame_tap import FrameTap

_log = logging.getLogger(__name__)

VIEWS = ("anaglyph", "difference", "depth", "wide_zoom")
SCALE = 0.5
SAME_EXPOSURE_NS = 2_000_000
IDLE_S = 0.1
"""Interval at which the presence of viewers is checked."""
SHORTEST_PERIOD_S = 0.08
SPARING_PERIOD_S = 0.5
"""Pause between pairs while a job has the rig, whose looks and computations have priority."""
SHARE = 0.6
"""Largest share of one core's time spent on these views."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LivePair:
    """Both foveae's frames of one exposure, and the newest wide frame then; None before the first."""

    left: Frame
    right: Frame
    volts: StereoVolts
    wide: Frame | None


def _grey(frame: Frame) -> Frame:
    return replace(frame, image=gray(to_uint8(frame)), bits=8)


class PairJoiner:
    """Pairs the frames of both foveae exposed by one pulse; holds only the newest pair."""

    def __init__(self) -> None:
        self._frames: dict[Role, Frame] = {}
        self._newest: LivePair | None = None
        self._changed = threading.Condition()

    def take(self, frame: Frame) -> None:
        """Add a frame of any camera; fast, as it is called on the cameras' thread."""
        with self._changed:
            self._frames[frame.role] = frame
            left, right = self._frames.get(Role.LEFT), self._frames.get(Role.RIGHT)
            if left is None or right is None or abs(left.t_ns - right.t_ns) > SAME_EXPOSURE_NS:
                return
            if frame.role is Role.WIDE or left.volts is None or right.volts is None:
                return
            volts = StereoVolts(left=left.volts, right=right.volts)
            self._newest = LivePair(left=left, right=right, volts=volts, wide=self._frames.get(Role.WIDE))
            self._changed.notify()

    def newest(self, timeout_s: float) -> LivePair | None:
        """Wait for a new pair and return the newest; None on timeout."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None, timeout_s)
            pair, self._newest = self._newest, None
            return pair


class SteadySpan:
    """Colour scale of the live depth: changes only when depths leave it, or use less than a third of it."""

    def __init__(self) -> None:
        self._span_m = (0.0, 0.0)

    def of(self, z_m: NDArray[np.float32]) -> tuple[float, float]:
        """Return nearest and farthest depth, m, of the scale for `z_m` (h, w)."""
        (low, high), (near, far) = self._span_m, depth_span(z_m)
        if near < low or far > high or far - near < 0.3 * (high - low):
            margin = 0.25 * (far - near)
            self._span_m = max(near - margin, 0.0), far + margin
        return self._span_m


class LiveStereo:
    """Publishes the views of both eyes on a separate thread."""

    def __init__(self, tap: FrameTap, *, calibration: Callable[[], Calibration | None], clock: Clock) -> None:
        self._tap = tap
        self._calibration = calibration
        self._clock = clock
        self._needed_elsewhere: Callable[[], bool] = lambda: False
        self.style = AnaglyphStyle.RED_CYAN
        """Colours of the anaglyph, for all viewers."""
        self._depth_span = SteadySpan()
        self._match: Callable[[RectifiedPair], DisparityMap] = BACKENDS["sgbm"].estimate
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="foveacam-live-stereo", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def spare_while(self, needed_elsewhere: Callable[[], bool]) -> None:
        """Lower the rate of pictures while `needed_elsewhere` returns true."""
        self._needed_elsewhere = needed_elsewhere

    def match_by(self, match: Callable[[RectifiedPair], DisparityMap]) -> None:
        """Compute the live depth by `match`."""
        self._match = match

    def close(self) -> None:
        """End the thread."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while not self._ended.wait(IDLE_S):
            if self._watched() and self._calibration() is not None:
                joiner = PairJoiner()
                with self._tap.listening(tuple(Role), joiner.take):
                    self._follow(joiner)

    def _follow(self, joiner: PairJoiner) -> None:
        """Publish each newest pair until there are no viewers."""
        while not self._ended.is_set() and (views := self._watched()):
            pair, calibration = joiner.newest(IDLE_S), self._calibration()
            if pair is None or calibration is None:
                continue
            if self._needed_elsewhere() and self._ended.wait(SPARING_PERIOD_S):
                return
            began_ns = self._clock.now_ns()
            try:
                self._show(pair, calibration, views)
            except FoveaError as error:
                _log.debug("live stereo: %s", error)  # pose outside the calibrated field
            spent_s = (self._clock.now_ns() - began_ns) / 1e9
            self._ended.wait(max(SHORTEST_PERIOD_S - spent_s, spent_s * (1.0 / SHARE - 1.0)))

    def _watched(self) -> list[str]:
        return [view for view in VIEWS if self._tap.watched(view)]

    def _show(self, frames: LivePair, calibration: Calibration, views: list[str]) -> None:
        t_ns = frames.left.t_ns
        if frames.wide is not None and "wide_zoom" in views:
            zoomed = rgb(wide_zoom(frames.wide, calibration, frames.volts, scale=SCALE))
            self._tap.publish_picture("wide_zoom", zoomed, t_ns=t_ns)
        if not set(views) - {"wide_zoom"}:
            return
        # grey: a third of the work, where no picture needs colours
        left, right = (
            (frames.left, frames.right) if "depth" in views else map(_grey, (frames.left, frames.right))
        )
        pair = rectify_frames(left, right, frames.volts, calibration, scale=SCALE)
        pictures: dict[str, Callable[[], NDArray[np.uint8]]] = {
            "anaglyph": lambda: anaglyph(pair, self.style),
            "difference": lambda: difference(pair),
            "depth": lambda: self._depth(pair),
        }
        for view, picture in pictures.items():
            if view in views:
                self._tap.publish_picture(view, picture(), t_ns=t_ns)

    def _depth(self, pair: RectifiedPair) -> NDArray[np.uint8]:
        """Return the depth picture of a pair, matched at half size and drawn at full size."""
        depth = depth_map(half := halved(pair), self._match(half))
        height, width = pair.left.shape[:2]
        z_m = cv2.resize(depth.z_m, (width, height), interpolation=cv2.INTER_NEAREST)
        near_m, far_m = self._depth_span.of(depth.z_m)
        full = replace(depth, z_m=np.asarray(z_m, dtype=np.float32))
        return depth_picture(full, near_m=near_m, far_m=far_m)
