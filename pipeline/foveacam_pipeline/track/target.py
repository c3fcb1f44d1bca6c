"""One followed target: its image tracker, its pictures in the foveae, its position and velocity."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.track.fovea_match import FOUND_SCORE, LOST_RATIOS, FoveaPicture, FoveaReading
from foveacam_pipeline.track.image_tracker import TrackBox, TrackerKind, TrackMatch
from foveacam_pipeline.track.position_filter import PositionEstimate, PositionFilter
from foveacam_pipeline.track.trackers import start_tracker
from foveacam_pipeline.verge.aim import aim_at, reaches

WIDE_SIGMA_PX = 1.0
"""Error of a place that the image tracker tells, wide px."""
FOVEA_SIGMA_PX = 2.0
"""Error of a direction that a look tells, fovea px; the same for the disparity."""
BIAS_GAIN = 0.3
"""Weight of the newest look in the mean offset of the image tracker from the target; larger at first."""
LOST_MISSES = 2
"""After so many looks in a row that do not show it a target counts as lost."""
AGAIN_SCORE = 0.7
"""A target that was lost must correlate so well in both foveae to be taken for found."""
FASTEST_M_PER_S = 5.0
"""What a look shows farther from where the target should be than this speed explains is another thing."""
COAST_NS = 1_500_000_000
"""A hidden target is taken to go on as it went for so long, then to stand."""
FIRST_SIGMA_SHARE = 0.02
"""Least standard error of the first position, as a share of its distance."""


class FollowState(StrEnum):
    """How a target stands."""

    FOLLOWED = "followed"
    """The foveae saw it in one of the last looks."""
    LOST = "lost"
    """Neither the last looks nor the wide view show it; it is searched for."""
    OUT_OF_FIELD = "out_of_field"
    """It has gone where the mirrors cannot turn, or out of the wide view."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetReport:
    """A followed target at one moment."""

    target_id: str
    state: FollowState
    estimate: PositionEstimate
    looks: int
    hits: int
    """Looks that showed it."""
    last_hit_ns: int
    score: float
    """Weaker correlation of both eyes in the last look that showed it."""
    wide_score: float | None
    """How well the image tracker fits; None while it does not find the target."""


class FollowedTarget:
    """A target that was verged on, followed from the look in which that was so."""

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
        """`sighting`, `point_rig_m`: a look that shows it, and its point, m. `wide`: the look's, grey.

        `velocity_rig_m_s`: as far as it is known. Raise `OutOfRange` where the wide view about it shows
        nothing that could be followed.
        """
        self.target_id = target_id
        self.priority = priority
        self._calibration = calibration
        self._box_px = box_px
        point = np.asarray(point_rig_m)
        t_ns = sighting.left.t_ns
        sigma_m = FIRST_SIGMA_SHARE * float(np.linalg.norm(point))
        self._filter = PositionFilter(point, sigma_m=sigma_m, t_ns=t_ns, velocity_rig_m_s=velocity_rig_m_s)
        self._confirmed = self._filter.copy()
        """What the looks that showed it tell alone: the wide view may follow something in front of it."""
        self._picture = FoveaPicture(
            sighting,
            calibration,
            aim_at(calibration, point[:2] / point[2], 1.0 / point[2]),
            inverse_z_per_m=1.0 / point[2],
        )
        self._wide: tuple[int, TrackMatch] | None = None
        self._misses, self._other, self._rests = 0, 0, False
        self._looks, self._hits, self._score = 0, 0, 1.0
        self._last_hit_ns = t_ns
        self.use_tracker(tracker, wide, sighting.wide.t_ns)

    def use_tracker(self, kind: TrackerKind, wide: NDArray[np.uint8], t_ns: int) -> None:
        """Change the image tracker: the new one learns the target where it is now.

        Raise `OutOfRange` where it is not inside the wide view; the tracker stays as it was.
        """
        x_px, y_px = self._wide_place(t_ns).tolist()
        box = TrackBox(x_px=x_px, y_px=y_px, width_px=self._box_px[0], height_px=self._box_px[1])
        binning = self._calibration.wide.binning_of(wide.shape)
        tracker = start_tracker(kind, wide, box, binning=binning)
        self._tracker, self.tracker = tracker, kind
        self._bias_px, self._compared = np.zeros(2), 0

    def at(self, t_ns: int) -> PositionEstimate:
        """Return where it is expected at a time."""
        return self._filter.at(t_ns)

    def aim(self, t_ns: int) -> PositionEstimate:
        """Return where to look for it at a time: a lost one in turns where it was seen last and elsewhere."""
        return self._aim(t_ns)[0]

    def _aim(self, t_ns: int) -> tuple[PositionEstimate, bool]:
        """Return where to look for it, and whether the wide view says so."""
        told = self._filter.at(t_ns), True
        if not self.lost:
            return told
        seen = self._confirmed.at(t_ns), False
        first, second = (seen, told) if self._misses % 2 == 0 else (told, seen)
        return first if self._reaches(first[0]) or not self._reaches(second[0]) else second

    @property
    def lost(self) -> bool:
        """Whether the last looks did not show it."""
        return self._misses >= LOST_MISSES

    def reachable(self, t_ns: int) -> bool:
        """Return whether both eyes can look at where it is expected."""
        return self._reaches(self.aim(t_ns))

    def _reaches(self, estimate: PositionEstimate) -> bool:
        if estimate.position_rig_m[2] <= 0.0:
            return False
        gazes = aim_at(self._calibration, estimate.tangents, estimate.inverse_z_per_m)
        return reaches(self._calibration, gazes)

    def see_wide(self, frame: Frame, wide: NDArray[np.uint8]) -> None:
        """Take a newer wide frame; `wide`: it in grey."""
        expected = self._wide_place(frame.t_ns)
        near = expected + self._bias_px
        match = self._tracker.update(wide, None if self.lost else (float(near[0]), float(near[1])))
        if match is None:
            self._wide = None
            return
        self._wide = frame.t_ns, match
        place = np.array([match.x_px, match.y_px]) - self._bias_px
        tangents = np.tan(self._calibration.wide.angles_rad(place[None])[0])
        sigma = WIDE_SIGMA_PX / self._calibration.wide.fx_px
        jumped = float(np.hypot(*(place - expected))) > max(self._box_px)
        if not jumped and self._filter.see(frame.t_ns, tangents, sigma=sigma):
            return
        self._misses = max(self._misses, LOST_MISSES)  # for the foveae to say whether it is the target
        inverse_z = self._confirmed.at(frame.t_ns).inverse_z_per_m
        self._filter = self._filter_at(tangents, inverse_z, frame.t_ns)

    def see_foveae(self, sighting: Sighting) -> FoveaReading | None:
        """Take a look at it; return what it shows, None where it does not show the target."""
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
            self._coast(t_ns)
            return None
        self._take(reading)
        return reading

    def report(self, t_ns: int) -> TargetReport:
        """Return how it stands at a time."""
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
        """Return whether the target can have come from where it was seen last to where a look shows it."""
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
        if not taken or self.lost:  # nothing that the wide view told meanwhile was of the target
            self._filter = self._confirmed.copy()
        self._rests = False
        self._misses = self._other = 0
        self._hits += 1
        self._score, self._last_hit_ns = reading.score, reading.t_ns
        if self._wide is not None:
            self._compare(*self._wide)

    def _compare(self, t_ns: int, match: TrackMatch) -> None:
        """Update the image tracker's offset from the target; refuse the match where it is of something else.

        The position is that of the foveae alone: the other filter already contains the wide view's error.
        """
        beside = np.array([match.x_px, match.y_px]) - self._wide_place(t_ns, self._confirmed)
        if float(np.hypot(*beside)) > max(self._box_px):
            self._tracker.refuse()
            self._wide = None
            return
        self._compared += 1
        self._bias_px += max(BIAS_GAIN, 1.0 / self._compared) * (beside - self._bias_px)

    def _doubt(self) -> None:
        """Refuse what the image tracker follows where two looks in a row at it do not show the target."""
        self._other += 1
        if self._other >= 2 and self._wide is not None:
            self._tracker.refuse()
            self._filter = self._confirmed.copy()
            self._wide, self._other = None, 0
            self._misses = max(self._misses, LOST_MISSES)

    def _coast(self, t_ns: int) -> None:
        """Let a target that was not seen for long stand where it should be by now."""
        if t_ns - self._last_hit_ns > COAST_NS and not self._rests:
            self._rests = True
            self._confirmed.rest(self._last_hit_ns + COAST_NS)

    def _filter_at(self, tangents: NDArray[np.float64], inverse_z: float, t_ns: int) -> PositionFilter:
        """Return a filter that begins anew at a place to which nothing led."""
        point = np.append(tangents, 1.0) / inverse_z
        sigma_m = FIRST_SIGMA_SHARE * float(np.linalg.norm(point))
        return PositionFilter(point, sigma_m=sigma_m, t_ns=t_ns)

    def _wide_place(self, t_ns: int, known: PositionFilter | None = None) -> NDArray[np.float64]:
        """Return where the wide view should show it by one of its filters, (2,) px."""
        tangents = (known or self._filter).at(t_ns).tangents
        pixels = self._calibration.wide.pixels(np.arctan(tangents)[None])
        return np.asarray(pixels[0], dtype=np.float64)
