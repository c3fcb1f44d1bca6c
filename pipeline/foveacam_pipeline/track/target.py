"""One followed target: its image tracker, its templates in the foveae, its position and velocity."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.track.fovea_match import FOUND_SCORE, LOST_RATIOS, FoveaPicture, FoveaReading
from foveacam_pipeline.track.image_tracker import TrackBox, TrackerKind, TrackMatch
from foveacam_pipeline.track.position_filter import PositionEstimate, PositionFilter
from foveacam_pipeline.track.template_tracker import BESIDE
from foveacam_pipeline.track.trackers import start_tracker
from foveacam_pipeline.verge.aim import aim_at, reaches

WIDE_SIGMA_PX = 1.0
"""Standard error of the image tracker's position, wide px."""
FOVEA_SIGMA_PX = 2.0
"""Standard error of a direction measured in a look, fovea px; also added to that of the disparity."""
BIAS_GAIN = 0.3
"""Gain of the running mean of the tracker's offset from the target; larger for the first looks."""
LOST_MISSES = 2
"""Looks in a row without the target after which it counts as lost."""
AGAIN_SCORE = 0.7
"""Least correlation of both foveae to re-acquire a lost target."""
FASTEST_M_PER_S = 5.0
"""Speed limit of the motion gate: a reading farther from the prediction is of another object."""
FADING_S = 0.7
"""Time constant of a target's velocity. One that is hidden is predicted on its way for a while, then at rest.
At constant speed the depth of a walker that only the wide view saw ran off, by 7 of 9 m in a few seconds."""
FIRST_SIGMA_SHARE = 0.02
"""Least standard error of the first position, as a share of its distance."""


class FollowState(StrEnum):
    """State of a followed target."""

    FOLLOWED = "followed"
    """Found in the foveae in one of the last looks."""
    LOST = "lost"
    """Not found in the last looks, or its image tracker jumped; it is searched for."""
    OUT_OF_FIELD = "out_of_field"
    """Beyond the mirrors' range or outside the wide view."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetReport:
    """State and estimate of a followed target at one time."""

    target_id: str
    state: FollowState
    estimate: PositionEstimate
    looks: int
    hits: int
    """Looks in which it was found."""
    last_hit_ns: int
    score: float
    """Lower correlation of both eyes in the last look that showed it."""
    wide_score: float | None
    """Score of the image tracker; None while it does not find the target."""


class FollowedTarget:
    """Tracks one target from the look in which it was acquired, by the wide view and the foveae."""

    def __init__(
        self,
        target_id: str,
        sighting: Sighting,
        point_rig_m: tuple[float, float, float],
        *,
        calibration: Calibration,
        wide: NDArray[np.uint8],
        tracker: TrackerKind = TrackerKind.TEMPLATE,
        box_px: tuple[int, int] = (64, 64),
        priority: float = 1.0,
        velocity_rig_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """`sighting`, `point_rig_m`: a look at the target and its position; `wide`: its wide image in grey.

        `velocity_rig_m_s`: initial estimate. Raise `OutOfRange` if the wide image has no texture there.
        """
        self.target_id = target_id
        self.priority = priority
        self._calibration = calibration
        self._box_px = box_px
        point = np.asarray(point_rig_m)
        t_ns = sighting.left.t_ns
        sigma_m = FIRST_SIGMA_SHARE * float(np.linalg.norm(point))
        self._filter = PositionFilter(
            point, sigma_m=sigma_m, t_ns=t_ns, fading_s=FADING_S, velocity_rig_m_s=velocity_rig_m_s
        )
        self._confirmed = self._filter.copy()
        """Filter updated by the foveae alone, because the tracker may follow an occluder in the wide view."""
        self._picture = FoveaPicture(
            sighting,
            calibration,
            aim_at(calibration, point[:2] / point[2], 1.0 / point[2]),
            inverse_z_per_m=1.0 / point[2],
        )
        self._wide: tuple[int, TrackMatch] | None = None
        self._misses, self._other = 0, 0
        self._looks, self._hits, self._score = 0, 0, 1.0
        self._last_hit_ns = t_ns
        self.use_tracker(tracker, wide, sighting.wide.t_ns)

    def use_tracker(self, kind: TrackerKind, wide: NDArray[np.uint8], t_ns: int) -> None:
        """Replace the image tracker; the new one learns the target at its estimated position.

        Raise `OutOfRange` if that is outside the wide view; the previous tracker then stays.
        """
        x_px, y_px = self._wide_place(t_ns).tolist()
        box = TrackBox(x_px=x_px, y_px=y_px, width_px=self._box_px[0], height_px=self._box_px[1])
        binning = self._calibration.wide.binning_of(wide.shape)
        tracker = start_tracker(kind, wide, box, binning=binning)
        self._tracker, self.tracker = tracker, kind
        self._bias_px, self._compared = np.zeros(2), 0

    def at(self, t_ns: int) -> PositionEstimate:
        """Return the position estimate at a time."""
        return self._filter.at(t_ns)

    def aim(self, t_ns: int) -> PositionEstimate:
        """Return the position to look at; looks at a lost target alternate with and without the wide view."""
        return self._aim(t_ns)[0]

    def _aim(self, t_ns: int) -> tuple[PositionEstimate, bool]:
        """Return the position to look at, and whether it includes the wide view's measurements."""
        fused = self._filter.at(t_ns), True
        if not self.lost:
            return fused
        confirmed = self._confirmed.at(t_ns), False
        untried = self._wide is not None and self._other == 0
        by_wide = untried or self._misses % 2 == 1
        first, second = (fused, confirmed) if by_wide else (confirmed, fused)
        return first if self._reaches(first[0]) or not self._reaches(second[0]) else second

    @property
    def missed(self) -> bool:
        """Whether the last look did not show it."""
        return self._misses > 0

    @property
    def lost(self) -> bool:
        """Whether the last `LOST_MISSES` looks did not show it."""
        return self._misses >= LOST_MISSES

    def reachable(self, t_ns: int) -> bool:
        """Return whether both eyes can look at the position returned by `aim`."""
        return self._reaches(self.aim(t_ns))

    def _reaches(self, estimate: PositionEstimate) -> bool:
        if estimate.position_rig_m[2] <= 0.0:
            return False
        gazes = aim_at(self._calibration, estimate.tangents, estimate.inverse_z_per_m)
        return reaches(self._calibration, gazes)

    @property
    def seen_px(self) -> tuple[float, float] | None:
        """Its place in the newest wide frame, px; None where it is not sure to be there."""
        if self.missed or self._wide is None:
            return None
        return self._wide[1].x_px, self._wide[1].y_px

    def see_wide(
        self, frame: Frame, wide: NDArray[np.uint8], others_px: Sequence[tuple[float, float]] = ()
    ) -> None:
        """Track the target in a newer wide frame and update its position.

        `wide`: the frame in grey. `others_px`: places of other targets in it.
        """
        self._tracker.avoid(others_px)
        expected = self._wide_place(frame.t_ns)
        near = expected + self._bias_px
        match = self._tracker.update(wide, None if self.lost else (float(near[0]), float(near[1])))
        if match is None:
            self._wide = None
            return
        if self.missed and self._is_another((match.x_px, match.y_px), others_px):
            self._refuse()
            return
        self._wide = frame.t_ns, match
        place = np.array([match.x_px, match.y_px]) - self._bias_px
        tangents = np.tan(self._calibration.wide.angles_rad(place[None])[0])
        sigma = WIDE_SIGMA_PX / self._calibration.wide.fx_px
        jumped = float(np.hypot(*(place - expected))) > max(self._box_px)
        if not jumped and self._filter.see(frame.t_ns, tangents, sigma=sigma):
            return
        self._misses = max(self._misses, LOST_MISSES)  # the foveae have to confirm it
        inverse_z = self._confirmed.at(frame.t_ns).inverse_z_per_m
        self._filter = self._filter_at(tangents, inverse_z, frame.t_ns)

    def see_foveae(self, sighting: Sighting) -> FoveaReading | None:
        """Update with a look at the target; return the reading, None if the target is not found."""
        t_ns = sighting.left.t_ns
        expected, by_wide = self._aim(t_ns)
        reading = self._picture.find(
            sighting,
            inverse_z_per_m=expected.inverse_z_per_m,
            least_score=AGAIN_SCORE if self.lost else FOUND_SCORE,
            ratios=LOST_RATIOS if self.lost else (1.0,),
        )
        self._looks += 1
        if reading is None or not self._possible(reading):
            self._misses += 1
            if by_wide:
                self._doubt()
            return None
        self._take(reading)
        return reading

    def report(self, t_ns: int) -> TargetReport:
        """Return state and estimate at a time."""
        state = FollowState.LOST if self.lost else FollowState.FOLLOWED
        if not self.reachable(t_ns):
            state = FollowState.OUT_OF_FIELD
        return TargetReport(
            target_id=self.target_id,
            state=state,
            estimate=self.at(t_ns),
            looks=self._looks,
            hits=self._hits,
            last_hit_ns=self._last_hit_ns,
            score=self._score,
            wide_score=None if self._wide is None else self._wide[1].score,
        )

    def _possible(self, reading: FoveaReading) -> bool:
        """Motion gate: return whether the target can have reached the reading's position by now."""
        unseen_s = (reading.t_ns - self._last_hit_ns) / 1e9
        seen = self._confirmed.at(reading.t_ns)
        moved_m = float(np.linalg.norm(np.asarray(reading.point.point_rig_m) - seen.position_rig_m))
        return moved_m <= FASTEST_M_PER_S * unseen_s + FIRST_SIGMA_SHARE * seen.distance_m

    def _take(self, reading: FoveaReading) -> None:
        calibration = self._calibration
        point = np.asarray(reading.point.point_rig_m)
        tangents, inverse_z = point[:2] / point[2], float(1.0 / point[2])
        disparity_px = float(np.hypot(reading.fine.sigma_x_px, FOVEA_SIGMA_PX))
        taken, confirmed = (
            known.see(
                reading.t_ns,
                tangents,
                sigma=FOVEA_SIGMA_PX / calibration.fovea_f_px,
                inverse_z_per_m=inverse_z,
                inverse_z_sigma_per_m=disparity_px / (calibration.fovea_f_px * calibration.baseline_m),
            )
            for known in (self._filter, self._confirmed)
        )
        if not confirmed:
            self._confirmed = self._filter_at(tangents, inverse_z, reading.t_ns)
        if not taken or self.lost:  # the wide view followed something else
            self._filter = self._confirmed.copy()
        self._misses = self._other = 0
        self._hits += 1
        self._score, self._last_hit_ns = reading.score, reading.t_ns
        if self._wide is not None:
            self._compare(*self._wide)

    def _compare(self, t_ns: int, match: TrackMatch) -> None:
        """Update the image tracker's offset from the target; refuse a match farther away than the box.

        Uses the position from the foveae alone: the other filter already contains the wide view's error.
        """
        beside = np.array([match.x_px, match.y_px]) - self._wide_place(t_ns, self._confirmed)
        if float(np.hypot(*beside)) > max(self._box_px):
            self._tracker.refuse()
            self._wide = None
            return
        self._compared += 1
        self._bias_px += max(BIAS_GAIN, 1.0 / self._compared) * (beside - self._bias_px)

    def _doubt(self) -> None:
        """Refuse the tracker's match when two looks at it, without a hit between, do not show the target."""
        self._other += 1
        if self._other >= 2 and self._wide is not None:
            self._refuse()

    def _is_another(self, place_px: tuple[float, float], others_px: Sequence[tuple[float, float]]) -> bool:
        """Return whether a match of the image tracker shows another target, which hides this one."""
        near = BESIDE * max(self._box_px)
        return any(math.dist(place_px, other_px) < near for other_px in others_px)

    def _refuse(self) -> None:
        """Reject the image tracker's match; the target is lost, and where the foveae saw it move."""
        self._tracker.refuse()
        self._filter = self._confirmed.copy()
        self._wide, self._other = None, 0
        self._misses = max(self._misses, LOST_MISSES)

    def _filter_at(self, tangents: NDArray[np.float64], inverse_z: float, t_ns: int) -> PositionFilter:
        """Return a new filter at a position that is unrelated to the previous track, with zero velocity."""
        point = np.append(tangents, 1.0) / inverse_z
        sigma_m = FIRST_SIGMA_SHARE * float(np.linalg.norm(point))
        return PositionFilter(point, sigma_m=sigma_m, t_ns=t_ns, fading_s=FADING_S)

    def _wide_place(self, t_ns: int, known: PositionFilter | None = None) -> NDArray[np.float64]:
        """Return the position in the wide view, (2,) px, predicted by `known` or the main filter."""
        tangents = (known or self._filter).at(t_ns).tangents
        pixels = self._calibration.wide.pixels(np.arctan(tangents)[None])
        return np.asarray(pixels[0], dtype=np.float64)
