"""Check of a calibration at poses outside its sweep: live looks at textured points between the nodes.

Two errors of the fitted models are measured (D3 measures them with a homography solved on the spot): the row
difference of the rectified foveae, and the offset of the eyes' gaze from the wide camera's view of a point.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Head, InvalidInput, Role, Sighting
from foveacam_pipeline.calibrate.drift.patches import DistinctnessMap, DriftPatch, select_patches
from foveacam_pipeline.calibrate.drift.place_finder import DriftExpectation, DriftPlaceFinder
from foveacam_pipeline.calibrate.drift.values import DriftPlace, DriftSettings
from foveacam_pipeline.calibrate.fit.fovea_in_wide import footprint_window, fovea_in_wide
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher, raise_if_cancelled
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8
from foveacam_pipeline.verge.aim import aim_at, gazes_under
from foveacam_pipeline.verge.matching.fine import MatchGuess, match_fine

PAUSE_NS = 300_000_000
"""Pause between the two wide images that are compared to detect motion."""
MAX_AGE_MS = 40.0
CORNER_SHARE = 0.55
"""Rows are compared at the image's centre and at points this share of the way to its corners."""
MIN_POSES = 4
VERGED_PX = 20.0
"""Maximum disparity of a look that is used for pictures, fovea px."""
FRAME_COLOURS = {Role.LEFT: (255, 140, 60), Role.RIGHT: (70, 170, 255)}


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckSettings:
    """Where a check looks, and which matches count.

    The field of regard is divided into `columns` x `rows`; one textured point is measured in each part.
    `margin_rad`: distance from the edge of the calibrated field. `apart_rad`: distance from every swept gaze.
    `score`, `sigma_px`: minimum correlation and maximum error of a row match, fovea px. `timeout_s`: on the
    rig's clock.
    """

    columns: int = 7
    rows: int = 6
    margin_rad: float = math.radians(0.3)
    apart_rad: float = math.radians(0.15)
    score: float = 0.85
    sigma_px: float = 0.12
    timeout_s: float = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RowMatch:
    """One point seen by both foveae. `gaze_rad`: mean (ax, ay) of the eyes. `offset_px`: from the gazes.

    `rows_px`: how much lower the point is in the left rectified image than in the right, fovea px.
    """

    gaze_rad: tuple[float, float]
    offset_px: tuple[float, float]
    rows_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PointingError:
    """Gaze of the eyes at a point minus its direction by the wide camera, (x, y) fovea px, mean of both."""

    missed_px: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckResult:
    """Errors of a calibration at points that it was not fitted to.

    `pointing_sigma_px`: measurement error of one pointing, both axes together; smaller errors do not show.
    `mosaic`: (h, w, 3) uint8 RGB, the wide view with the rectified foveae drawn over it. `farthest`: the look
    farthest from the middle, for pictures.
    """

    calibration_id: str
    rows: tuple[RowMatch, ...]
    pointings: tuple[PointingError, ...]
    pointing_sigma_px: float
    looks: int
    mosaic: NDArray[np.uint8]
    farthest: Sighting | None

    @property
    def poses(self) -> int:
        """Number of measured points."""
        return len(self.pointings)

    @property
    def epipolar_rms_px(self) -> float | None:
        """Root mean square of the row differences, fovea px; None when nothing matched."""
        return _rms([match.rows_px for match in self.rows])

    @property
    def epipolar_p95_px(self) -> float | None:
        """95 % quantile of the row differences, fovea px; None when nothing matched."""
        sizes = [abs(match.rows_px) for match in self.rows]
        return float(np.quantile(sizes, 0.95)) if sizes else None

    @property
    def pointing_rms_px(self) -> float | None:
        """Root mean square of the pointing errors as distances, the measurement's own error included."""
        return _rms([math.hypot(*pointing.missed_px) for pointing in self.pointings])


def _rms(values: list[float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values else None


def check_calibration(
    head: Head,
    calibration: Calibration,
    *,
    clock: Clock,
    watch: ProcedureWatcher | None = None,
    settings: CheckSettings | None = None,
    swept_rad: NDArray[np.float64] | None = None,
) -> CheckResult:
    """Look at points all over the field of regard and return the calibration's errors there.

    `swept_rad`: (n, 2) gazes at which it was fitted; points nearer to one than the settings allow are left
    out. Raise InvalidInput when the scene shows too few usable points.
    """
    run = _CheckRun(
        head, calibration, clock=clock, watch=watch or SilentWatcher(), settings=settings or CheckSettings()
    )
    return run.result(swept_rad)


class _CheckRun:
    """The looks of one check."""

    def __init__(
        self,
        head: Head,
        calibration: Calibration,
        *,
        clock: Clock,
        watch: ProcedureWatcher,
        settings: CheckSettings,
    ) -> None:
        self._head = head
        self._calibration = calibration
        self._clock = clock
        self._watch = watch
        self._settings = settings
        self._drift_settings = DriftSettings(
            columns=settings.columns, rows=settings.rows, margin_rad=settings.margin_rad, layout=None
        )
        self._finder = DriftPlaceFinder(head, calibration, self._drift_settings)
        self._rows: list[RowMatch] = []
        self._pointings: list[PointingError] = []
        self._farthest: tuple[float, Sighting] | None = None

    def result(self, swept_rad: NDArray[np.float64] | None) -> CheckResult:
        """Measure one point in each part of the field and return the result."""
        deadline_ns = self._clock.now_ns() + round(1e9 * self._settings.timeout_s)
        views = self._two_views()
        queue = [
            candidate
            for candidate in select_patches(
                DistinctnessMap.of(views, self._calibration, self._drift_settings),
                self._calibration,
                self._drift_settings,
            )
            if self._is_off_nodes(candidate, swept_rad)
        ]
        mosaic = np.repeat(views[1][:, :, None], 3, axis=2)
        done: set[int] = set()
        total = len({candidate.part for candidate in queue})
        expected = DriftExpectation()
        for candidate in queue:
            raise_if_cancelled(self._watch, doing="the check")
            if candidate.part in done or self._clock.now_ns() > deadline_ns:
                continue
            place = self._finder.measure(candidate, expected)
            if place is None or self._finder.last is None:
                continue
            done.add(candidate.part)
            self._add_place(place, self._finder.last)
            self._draw_fovea(mosaic, self._finder.last, len(done))
            self._watch.progress(len(done), total=total, note=f"{len(self._rows)} rows compared")
            self._watch.show("wide", mosaic)
        return self._result(mosaic)

    def _result(self, mosaic: NDArray[np.uint8]) -> CheckResult:
        if len(self._pointings) < MIN_POSES:
            raise InvalidInput(
                f"check: both foveae found {len(self._pointings)} places of the wide view, {MIN_POSES} are "
                "needed; turn the rig to a scene with texture, or calibrate the mirrors again"
            )
        placed = math.sqrt(2.0) * self._drift_settings.placed_sigma_wide_px / self._calibration.wide.fx_px
        return CheckResult(
            calibration_id=self._calibration.id,
            rows=tuple(self._rows),
            pointings=tuple(self._pointings),
            pointing_sigma_px=placed * self._calibration.fovea_f_px,
            looks=self._finder.looks,
            mosaic=mosaic,
            farthest=None if self._farthest is None else self._farthest[1],
        )

    def _two_views(self) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        first = gray(to_uint8(self._head.wide()))
        self._clock.sleep_until_ns(self._clock.now_ns() + PAUSE_NS)
        return first, gray(to_uint8(self._head.wide(max_age_ms=MAX_AGE_MS)))

    def _is_off_nodes(self, candidate: DriftPatch, swept_rad: NDArray[np.float64] | None) -> bool:
        if swept_rad is None or not len(swept_rad):
            return True
        apart = np.linalg.norm(np.arctan(candidate.template.target) - swept_rad, axis=1)
        return bool(apart.min() >= self._settings.apart_rad)

    def _add_place(self, place: DriftPlace, sighting: Sighting) -> None:
        """Add the pointing error of a place and the row matches of its look."""
        gazes = gazes_under(self._calibration, sighting.volts)
        middle = (gazes.left + gazes.right) / 2.0
        true = aim_at(
            self._calibration,
            np.array(place.target),
            (place.left[0] - place.right[0]) / self._calibration.baseline_m,
        )
        missed = (place.seen(Role.LEFT) - true.left + place.seen(Role.RIGHT) - true.right) / 2.0
        x_px, y_px = (self._calibration.fovea_f_px * missed).tolist()
        self._pointings.append(PointingError(missed_px=(x_px, y_px)))
        beside = place.seen(Role.LEFT) - gazes.left, place.seen(Role.RIGHT) - gazes.right
        self._rows += match_rows(sighting, self._calibration, self._settings, beside=beside)
        reach = float(np.linalg.norm(middle))
        verged = float(np.abs(beside[0] - beside[1]).max()) * self._calibration.fovea_f_px < VERGED_PX
        if verged and (self._farthest is None or reach > self._farthest[0]):
            self._farthest = reach, sighting

    def _draw_fovea(self, mosaic: NDArray[np.uint8], sighting: Sighting, count: int) -> None:
        """Draw one eye's fovea over the wide view with a thin frame, alternating between the eyes."""
        role = Role.LEFT if count % 2 else Role.RIGHT
        window = footprint_window(self._calibration, role, sighting, zoom=1.0)
        shown, seen = fovea_in_wide(sighting, self._calibration, role, window)
        y, x = round(window.y0_px), round(window.x0_px)
        part = mosaic[y : y + window.height, x : x + window.width]
        part[seen] = shown[seen][:, None]
        inside = cv2.erode(seen.astype(np.uint8), np.ones((3, 3), dtype=np.uint8), borderValue=0) > 0
        part[seen & ~inside] = FRAME_COLOURS[role]


def match_rows(
    sighting: Sighting,
    calibration: Calibration,
    settings: CheckSettings,
    *,
    beside: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> list[RowMatch]:
    """Return the row differences of both rectified foveae at those of five points of a look that match.

    `beside`: (2,) tangents from the left and from the right gaze to one point that both eyes see.
    """
    half = np.array([calibration.fovea_width, calibration.fovea_height]) / 2.0
    gazes = gazes_under(calibration, sighting.volts)
    ax_rad, ay_rad = np.arctan((gazes.left + gazes.right) / 2.0).tolist()
    found = []
    for x, y in (
        (0.0, 0.0),
        (-CORNER_SHARE, -CORNER_SHARE),
        (CORNER_SHARE, -CORNER_SHARE),
        (CORNER_SHARE, CORNER_SHARE),
        (-CORNER_SHARE, CORNER_SHARE),
    ):
        aside = np.array([x, y]) * half / calibration.fovea_f_px
        guess = MatchGuess(left=beside[0] + aside, right=beside[1] + aside)
        fine = match_fine(sighting, calibration, guess)
        if fine.score < settings.score or fine.sigma_y_px > settings.sigma_px:
            continue
        place = calibration.fovea_f_px * (guess.left + guess.right) / 2.0
        found.append(
            RowMatch(
                gaze_rad=(ax_rad, ay_rad),
                offset_px=(float(place[0]), float(place[1])),
                rows_px=_centre_row_difference_px(sighting, calibration, guess) + fine.residual_y_px,
            )
        )
    return found


def _centre_row_difference_px(sighting: Sighting, calibration: Calibration, guess: MatchGuess) -> float:
    """Return how much lower the left eye's image centre lies on its plane than the right one's, px."""
    gazes = gazes_under(calibration, sighting.volts)
    apart = float(gazes.left[0] + guess.left[0] - gazes.right[0] - guess.right[0])
    depth_m = calibration.baseline_m / apart if apart > 0.0 else math.inf
    centre = np.array([(calibration.fovea_width - 1) / 2, (calibration.fovea_height - 1) / 2, 1.0])
    heights = []
    for role in (Role.LEFT, Role.RIGHT):
        place = plane_from_raw(calibration, role, sighting.volts, depth_m=depth_m) @ centre
        heights.append(float(place[1] / place[2]))
    return heights[0] - heights[1]
