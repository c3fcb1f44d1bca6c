"""Wide frames of a pose: several frames of the markers at rest, and their mean."""

import math

import numpy as np

from foveacam_hardware.contract import Clock, Frame, Head, Timeout
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.markers import find_markers, mean_view, middle_px, refind_marker
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8

MAX_READS = 20


class WideMarkersAtRest:
    """Frames exposed after a moment, all of which must show the markers at the same position."""

    def __init__(self, head: Head, clock: Clock, layout: MarkerLayout, *, since_ns: int) -> None:
        self._head = head
        self._layout = layout
        self._clock = clock
        self._since_ns = since_ns
        self.frame = next_wide_frame(head, clock, since_ns=since_ns)
        self.image = to_uint8(self.frame)
        self.gray = gray(self.image)
        self.views = find_markers(
            self.gray, side_m=layout.side_m, only=layout.ids, binning=self.frame.binning
        )
        self._series: dict[int, list[MarkerView]] = {k: [view] for k, view in self.views.items()}
        self._last = self.frame
        self._frames = 1

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the sensor, px."""
        return self.frame.binning * self.gray.shape[1], self.frame.binning * self.gray.shape[0]

    def add(self, frame: Frame) -> None:
        """Add a frame, unless it was added already; a marker that it does not show is dropped."""
        if frame.seq == self._last.seq or _begin_ns(frame) < self._since_ns:
            return
        self._last = frame
        self._frames += 1
        shades = gray(to_uint8(frame))
        for marker_id, series in list(self._series.items()):
            again = refind_marker(shades, series[0], side_m=self._layout.side_m, binning=frame.binning)
            if again is None:
                del self._series[marker_id]
            else:
                series.append(again)

    def fill(self, frames: int) -> None:
        """Read the wanted number of frames; raise Timeout when the camera repeats one."""
        for _ in range(MAX_READS):
            if self._frames >= frames:
                return
            age_ms = max(0.0, (self._clock.now_ns() - self._last.t_ns) / 1e6 - 1.0)
            self.add(self._head.wide(max_age_ms=age_ms))
        raise Timeout("wide camera: it delivers the same frame again and again; check that it runs freely")

    def moved_px(self) -> float:
        """Return the largest movement of a marker from its mean, wide px; infinite when all were lost."""
        if self.views and not self._series:
            return math.inf
        spreads = [0.0]
        for series in self._series.values():
            middles = np.array([middle_px(view) for view in series])
            spreads.append(float(np.abs(middles - middles.mean(axis=0)).max()))
        return max(spreads)

    def mean_views(self) -> dict[int, MarkerView]:
        """Return the markers by id, the mean over the frames."""
        return {marker_id: mean_view(series) for marker_id, series in self._series.items()}


def next_wide_frame(head: Head, clock: Clock, *, since_ns: int) -> Frame:
    """Return a wide frame whose exposure began at `since_ns` or later; raise Timeout when none comes."""
    oldest_ns = since_ns
    for _ in range(MAX_READS):
        frame = head.wide(max_age_ms=max(0.0, (clock.now_ns() - oldest_ns) / 1e6))
        if _begin_ns(frame) >= since_ns:
            return frame
        oldest_ns = max(oldest_ns, frame.t_ns + 1_000_000)
    raise Timeout(
        f"wide camera: its newest frame is {(since_ns - frame.t_ns) / 1e6:.0f} ms too old (stale); "
        "check that it runs freely, and its link"
    )


def _begin_ns(frame: Frame) -> int:
    return frame.t_ns - frame.exposure_ns // 2
