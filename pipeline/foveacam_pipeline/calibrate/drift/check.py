"""Drift checks (Sec. 3.3): measure how far each eye has moved since it was calibrated.

`run_drift_check` looks at the scene; `check_drift_at_nodes` uses nodes of a sweep that were visited again.
Nothing is changed here: `correction` makes a corrected calibration of a check.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Frame, Head, Role
from foveacam_pipeline.calibrate.drift.fit import (
    DriftFit,
    eye_drifts,
    field_tangents,
    fit_drift,
    vertical_offset_terms,
)
from foveacam_pipeline.calibrate.drift.patches import (
    DistinctnessMap,
    DriftPatch,
    draw_patches,
    patches_of_known_depth,
    select_patches,
)
from foveacam_pipeline.calibrate.drift.place_finder import DriftExpectation, DriftPlaceFinder
from foveacam_pipeline.calibrate.drift.values import (
    TERMS,
    DriftCheck,
    DriftPlace,
    DriftSettings,
    EyeDrift,
    EyeTurn,
    describe_check,
)
from foveacam_pipeline.calibrate.fit.measured import DistanceSource, NominalRig, PlacedPose, locate_targets
from foveacam_pipeline.calibrate.fit.measured_rows import FitRow, eye_rows
from foveacam_pipeline.calibrate.sweep.sweep import Sweep, SweepPose
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher, raise_if_cancelled
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import EYES, aim_at

PAUSE_NS = 300_000_000
"""Pause between the two wide images that are compared to detect motion."""
MAX_AGE_MS = 40.0
AGREE_SIGMAS = 4.0
"""A place agrees when its residual is below this many standard errors."""
MIN_SPREAD = 0.4
"""Minimum share of the field of regard, along each axis, that the places of a lock must cover."""
DEFAULT_SETTINGS = DriftSettings()
NODE_SIGMA_PX = 0.06
"""Noise of one node, each axis, fovea px, without the error of the mirror model there."""
NODE_SETTINGS = DriftSettings(
    lens_sigma_wide_px=0.003,
    turn_prior_rad=math.radians(1.0),
    roll_prior_rad=math.radians(0.02),
    stretch_prior=1e-6,
    least_places=4,
    significant=1.0,
    layout=None,
)
"""Heat turns a mount, but hardly stretches a mirror's angles or rolls an eye: hence the narrow priors. A turn
is corrected once it exceeds its standard error, because markers, unlike a scene, cannot be mismatched."""


def run_drift_check(
    head: Head,
    calibration: Calibration,
    *,
    clock: Clock,
    watch: ProcedureWatcher | None = None,
    settings: DriftSettings = DEFAULT_SETTINGS,
) -> DriftCheck:
    """Look at places all over the field of regard and return how far the eyes have moved."""
    watch = watch or SilentWatcher()
    started_ns = clock.now_ns()
    frames = _two_frames(head, clock)
    run = _DriftRound(head, calibration, clock=clock, watch=watch, settings=settings)
    places = run.measure_places(frames, started_ns=started_ns)
    duration_s = (clock.now_ns() - started_ns) / 1e9
    return evaluate_drift(places, calibration, settings=settings, looks=run.looks, duration_s=duration_s)


def evaluate_drift(
    places: tuple[DriftPlace, ...],
    calibration: Calibration,
    *,
    settings: DriftSettings = DEFAULT_SETTINGS,
    looks: int = 0,
    duration_s: float = 0.0,
) -> DriftCheck:
    """Return the drift that places show of the calibration they were measured with."""
    if not places:
        return _empty_check(calibration, settings, looks=looks, duration_s=duration_s)
    fit = fit_drift(places, calibration, settings)
    marked = tuple(
        replace(place, agrees=bool(missed < AGREE_SIGMAS))
        for place, missed in zip(places, fit.miss_sigmas, strict=True)
    )
    known = _vergence_known(marked, fit, calibration, settings)
    left, right = eye_drifts(*_without_vergence(fit, vergence=known), calibration, settings)
    locked = _has_lock(marked, calibration, settings)
    significant = locked and (left.significant or right.significant)
    height = vertical_offset_terms(fit) if locked and not significant else None
    if height is not None:
        left, right = eye_drifts(*height, calibration, settings)
        significant = True
    found = DriftCheck(
        calibration_id=calibration.id,
        rig_id=calibration.rig_id,
        places=marked,
        looks=looks,
        left=left,
        right=right,
        vergence_known=known,
        vergence_sigma_rad=0.0
        if known or not significant
        else _unmeasured_vergence_sigma_rad(left.turn, right.turn),
        locked=locked,
        significant=significant,
        height_alone=height is not None,
        residual_px=fit.residual_px,
        duration_s=duration_s,
        detail="",
    )
    return replace(found, detail=describe_check(found, settings=settings, f_px=calibration.fovea_f_px))


class _DriftRound:
    """The looks of one check."""

    def __init__(
        self,
        head: Head,
        calibration: Calibration,
        *,
        clock: Clock,
        watch: ProcedureWatcher,
        settings: DriftSettings,
    ) -> None:
        self._finder = DriftPlaceFinder(head, calibration, settings)
        self._calibration = calibration
        self._clock = clock
        self._watch = watch
        self._settings = settings
        self._done: dict[int, DriftPlace] = {}

    @property
    def looks(self) -> int:
        """Number of looks taken."""
        return self._finder.looks

    def measure_places(self, frames: tuple[Frame, Frame], *, started_ns: int) -> tuple[DriftPlace, ...]:
        """Return one measured place of each part of the field of regard, as far as there was time."""
        first, second = (gray(to_uint8(frame)) for frame in frames)
        field = DistinctnessMap.of((first, second), self._calibration, self._settings)
        known = patches_of_known_depth(field, self._calibration, self._settings)
        queue = [*known, *select_patches(field, self._calibration, self._settings)]
        expected = DriftExpectation()
        total = len({candidate.part for candidate in queue})
        for candidate in queue:
            raise_if_cancelled(self._watch, doing="the drift check")
            if candidate.part in self._done:
                continue
            if self._time_is_up(started_ns):
                break
            self._measure(candidate, expected)
            self._watch.progress(len(self._done), total=total, note=f"{self.looks} looks")
            self._watch.show("wide", draw_patches(second, self._calibration, queue, set(self._done)))
        return tuple(self._done.values())

    def _time_is_up(self, started_ns: int) -> bool:
        """Return whether the time limit has passed; without a lock it is longer, for slow computers."""
        took_s = (self._clock.now_ns() - started_ns) / 1e9
        if took_s <= self._settings.timeout_s:
            return False
        found = evaluate_drift(tuple(self._done.values()), self._calibration, settings=self._settings)
        return found.locked or took_s > self._settings.longest_s

    def _measure(self, candidate: DriftPatch, expected: DriftExpectation) -> None:
        place = self._finder.measure(candidate, expected)
        if place is not None:
            self._done[candidate.part] = place


def _two_frames(head: Head, clock: Clock) -> tuple[Frame, Frame]:
    first = head.wide()
    clock.sleep_until_ns(clock.now_ns() + PAUSE_NS)
    return first, head.wide(max_age_ms=MAX_AGE_MS)


def _empty_check(
    calibration: Calibration, settings: DriftSettings, *, looks: int, duration_s: float
) -> DriftCheck:
    still = EyeDrift(
        turn=EyeTurn(),
        shift_sigma_rad=(settings.turn_prior_rad, settings.turn_prior_rad),
        roll_sigma_rad=settings.roll_prior_rad,
        moved_px=0.0,
        sigma_px=math.sqrt(2.0) * settings.turn_prior_rad * calibration.fovea_f_px,
        significant=False,
    )
    return DriftCheck(
        calibration_id=calibration.id,
        rig_id=calibration.rig_id,
        places=(),
        looks=looks,
        left=still,
        right=still,
        vergence_known=False,
        vergence_sigma_rad=0.0,
        locked=False,
        significant=False,
        residual_px=0.0,
        duration_s=duration_s,
        detail="No place of the wide view was found in both foveae; look at a scene with texture, or "
        "calibrate the mirrors again.",
    )


def _vergence_known(
    places: tuple[DriftPlace, ...], fit: DriftFit, calibration: Calibration, settings: DriftSettings
) -> bool:
    has_depth = any(place.inverse_depth is not None and place.agrees for place in places)
    apart_px = 2.0 * fit.vergence_sigma_rad * calibration.fovea_f_px
    return has_depth and apart_px <= settings.vergence_sigma_px


def _without_vergence(fit: DriftFit, *, vergence: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (12,) terms and their covariance; without `vergence` the angle between the eyes is unchanged."""
    if vergence:
        return fit.terms, fit.covariance
    along = np.zeros(2 * TERMS)
    along[[1, TERMS + 1]] = math.sqrt(0.5), -math.sqrt(0.5)
    keep = np.eye(2 * TERMS) - np.outer(along, along)
    return keep @ fit.terms, keep @ fit.covariance @ keep


def _has_lock(places: tuple[DriftPlace, ...], calibration: Calibration, settings: DriftSettings) -> bool:
    """Return whether enough places agree, spread over the field."""
    agreeing = np.array([place.target for place in places if place.agrees])
    if len(agreeing) < max(settings.least_places, settings.least_share * len(places)):
        return False
    field = field_tangents(calibration, Role.LEFT)
    return bool((np.ptp(agreeing, axis=0) > MIN_SPREAD * np.ptp(field, axis=0)).all())


def _unmeasured_vergence_sigma_rad(left: EyeTurn, right: EyeTurn) -> float:
    """Return the standard error of the unmeasured change of half the angle between the eyes.

    A mount moves in every direction alike, so the unmeasured part is assumed as large as the measured ones.
    """
    across = (left.shift_rad[0] + right.shift_rad[0]) / 2.0
    each = math.sqrt((left.shift_rad[1] ** 2 + right.shift_rad[1] ** 2 + 2.0 * across**2) / 3.0)
    return each / math.sqrt(2.0)


def check_drift_at_nodes(
    sweeps: Sequence[Sweep],
    visits: Sequence[SweepPose],
    calibration: Calibration,
    *,
    distance: DistanceSource,
) -> DriftCheck:
    """Return how far the eyes have moved against a calibration, by nodes of its sweeps visited again.

    Markers are measured ten times as well as a scene's texture, and the wide lens's error at a node was the
    same during the sweep, so drift of some tenths of a pixel is seen, as in the minutes since a sweep.
    `sweeps`: those the calibration was fitted to, the visits among their repeats. Raise InvalidInput when
    the pose of a target cannot be found.
    """
    placed, _, _ = locate_targets(sweeps, calibration.wide, distance=distance)
    wanted = {(pose.run, pose.index, pose.repeat) for pose in visits}
    seen = [one for one in placed if (one.pose.run, one.pose.index, one.pose.repeat) in wanted]
    places = tuple(place for one in seen if (place := _node_place(one, calibration, distance)) is not None)
    # the error that a calibration states includes the expected drift, which is measured here
    still = replace(
        calibration,
        left=_without_stated_sigma(calibration.left),
        right=_without_stated_sigma(calibration.right),
    )
    found = evaluate_drift(
        places, still, settings=NODE_SETTINGS, looks=len(visits), duration_s=_duration_s(visits)
    )
    return replace(found, calibration_id=calibration.id)


def _without_stated_sigma(eye: EyeCalibration) -> EyeCalibration:
    return replace(eye, mirror=replace(eye.mirror, sigma_rad=(0.0, 0.0)))


def _duration_s(visits: Sequence[SweepPose]) -> float:
    times = [pose.t_ns for pose in visits]
    return 1e-9 * (max(times) - min(times)) if times else 0.0


def _node_place(placed: PlacedPose, calibration: Calibration, distance: DistanceSource) -> DriftPlace | None:
    """Return the target's middle as seen by the wide camera and both eyes; None if an eye missed it."""
    middle = placed.target.middle_m
    target, inverse = middle[:2] / middle[2], 1.0 / float(middle[2])
    true = aim_at(calibration, target, inverse)
    seen = []
    for role in EYES:
        drawing = NominalRig(rig_id="", baseline_m=calibration.baseline_m, fovea_f_px=calibration.fovea_f_px)
        size = calibration.fovea_width, calibration.fovea_height
        centre_px = np.array([(size[0] - 1) / 2.0, (size[1] - 1) / 2.0])
        rows = eye_rows([placed], role, drawing, distance, centre_px=centre_px)
        if not rows:
            return None
        seen.append(true.eye(role) + _model_error(rows[0], role, calibration))
    lack = max(max(calibration.eye(role).mirror.loo_rad) for role in EYES)
    sigma = math.hypot(NODE_SIGMA_PX / calibration.fovea_f_px, lack)
    (x, y), (left_x, left_y), (right_x, right_y) = target.tolist(), seen[0].tolist(), seen[1].tolist()
    return DriftPlace(
        target=(x, y),
        left=(left_x, left_y),
        right=(right_x, right_y),
        sigma=(sigma, sigma, sigma),
        score=1.0,
        t_ns=placed.pose.t_ns,
        inverse_depth=inverse,
        inverse_sigma=0.0,
    )


def _model_error(row: FitRow, role: Role, calibration: Calibration) -> NDArray[np.float64]:
    """Return the modelled minus the measured gaze of the image centre, (2,) tangents."""
    point = calibration.reference_rig_m(role) + row.depth_m * np.array([*np.tan(row.angles_rad), 1.0])
    ray = point - calibration.pivot_rig_m(role)
    modelled = calibration.eye(role).mirror.angles_of(np.array([row.eye.volts_v]))[0]
    return np.asarray(np.tan(modelled) - ray[:2] / ray[2], dtype=np.float64)
