"""One followed target: its request, its state, its hits. Read and written under the table's lock."""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.track.acquire import ClickTrack
from foveacam_pipeline.track.position_filter import PositionEstimate, led_s
from foveacam_pipeline.track.target import FADING_S, TargetReport
from foveacam_pipeline.verge.values import Target
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.looking.follows.schema import (
    FollowedDocument,
    FollowedState,
    FollowPatch,
    TrackerName,
    TrailPoint,
)

TRAIL = 600
"""Number of hits kept of each target."""
RATE_WINDOW_NS = 2_000_000_000


@dataclass(slots=True, kw_only=True)
class FollowedRecord:
    """Mutable record of one followed target."""

    id: str
    label: str
    target: Target
    box_px: tuple[int, int]
    """Width and height of the image tracker's template, wide px."""
    tracker: TrackerName
    priority: float
    state: FollowedState = "finding"
    created_utc: str = field(default_factory=utc_now)
    click: ClickTrack | None = None
    """Track of the clicked target until the foveae's first look; None where its frame is not held."""
    report: TargetReport | None = None
    hits: deque[PositionEstimate] = field(default_factory=lambda: deque(maxlen=TRAIL))

    def describe(self, calibration: Calibration | None, *, now_ns: int) -> FollowedDocument:
        """Return its REST document, with the place extrapolated to this moment."""
        report = self.report
        if report is None:
            return self._head()
        position = position_at(report.estimate, now_ns)
        velocity = report.estimate.velocity_rig_m_s
        pixel = None if calibration is None else wide_place_px(calibration, position)
        return self._head().model_copy(
            update={
                "x_px": None if pixel is None else round(pixel[0], 2),
                "y_px": None if pixel is None else round(pixel[1], 2),
                "point_rig_m": position,
                "velocity_rig_m_s": (float(velocity[0]), float(velocity[1]), float(velocity[2])),
                "distance_m": float(np.linalg.norm(position)),
                "distance_sigma_m": report.estimate.distance_sigma_m,
                "speed_m_s": float(np.linalg.norm(velocity)),
                "looks": report.looks,
                "hits": report.hits,
                "rate_hz": self._rate_hz(now_ns),
                "age_s": max(0.0, (now_ns - report.last_hit_ns) / 1e9),
                "score": report.score,
                "wide_score": report.wide_score,
            }
        )

    def take(self, patch: FollowPatch) -> None:
        """Apply a request's changes."""
        self.label = patch.label or self.label
        self.tracker = patch.tracker or self.tracker
        self.priority = patch.priority or self.priority

    def trail(self) -> list[TrailPoint]:
        """Return its hits as documents, oldest first."""
        return [
            TrailPoint(
                t_s=hit.t_ns / 1e9,
                x_m=float(hit.position_rig_m[0]),
                y_m=float(hit.position_rig_m[1]),
                z_m=float(hit.position_rig_m[2]),
                distance_sigma_m=hit.distance_sigma_m,
            )
            for hit in self.hits
        ]

    def _head(self) -> FollowedDocument:
        return FollowedDocument(
            id=self.id,
            label=self.label,
            state=self.state,
            tracker=self.tracker,
            priority=self.priority,
            created_utc=self.created_utc,
        )

    def _rate_hz(self, now_ns: int) -> float:
        recent = sum(now_ns - hit.t_ns <= RATE_WINDOW_NS for hit in self.hits)
        return round(recent / (RATE_WINDOW_NS / 1e9), 2)


def position_at(estimate: PositionEstimate, now_ns: int) -> tuple[float, float, float]:
    """Return the point, m, rig frame, extrapolated to a time at the target's speed, which fades."""
    ahead_s = led_s((now_ns - estimate.t_ns) / 1e9, FADING_S)
    moved = estimate.position_rig_m + ahead_s * estimate.velocity_rig_m_s
    return float(moved[0]), float(moved[1]), float(moved[2])


def wide_place_px(
    calibration: Calibration, point_rig_m: tuple[float, float, float]
) -> tuple[float, float] | None:
    """Return the wide pixel of a point; None outside the wide image."""
    x_m, y_m, z_m = point_rig_m
    if z_m <= 0.0:
        return None
    x_px, y_px = calibration.wide.pixels([np.arctan([x_m / z_m, y_m / z_m])])[0].tolist()
    return (x_px, y_px) if calibration.wide.contains(x_px, y_px) else None
