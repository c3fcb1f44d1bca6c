"""One-shot check of drift in the field (Sec. 3.3): how far has each eye moved since it was calibrated?

Places all over the field of regard are looked at with both eyes and compared with the wide camera. `applied`
makes a calibration of it, when it is sure enough.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Frame, Head, NotCalibrated, Role
from foveacam_pipeline.calibrate.drift.drift_eyes import eye_drifts, field_of
from foveacam_pipeline.calibrate.drift.drift_fit import DriftFit, fit_drift
from foveacam_pipeline.calibrate.drift.drift_height import height_alone
from foveacam_pipeline.calibrate.drift.drift_known import known_spots
from foveacam_pipeline.calibrate.drift.drift_look import DriftExpectation, DriftPlaceFinder
from foveacam_pipeline.calibrate.drift.drift_places import DistinctnessMap, DriftPatch, spots
from foveacam_pipeline.calibrate.drift.drift_turn import TERMS, EyeTurn, turned_eye
from foveacam_pipeline.calibrate.drift.drift_values import DriftCheck, DriftPlace, DriftSettings, EyeDrift
from foveacam_pipeline.calibrate.drift.drift_view import drift_view
from foveacam_pipeline.calibrate.drift.drift_words import words
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher, check
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import EYES

PAUSE_NS = 300_000_000
"""Between the two pictures that tell what moves."""
FRESH_MS = 40.0
AGREES = 4.0
"""A place agrees when it misses by less than so many standard errors."""
SPREAD = 0.4
"""The places of a lock cover at least this share of the field of regard along both axes."""
DEFAULT = DriftSettings()


def one_shot(
    head: Head,
    calibration: Calibration,
    *,
    clock: Clock,
    watch: ProcedureWatcher | None = None,
    settings: DriftSettings = DEFAULT,
) -> DriftCheck:
    """Look, compare, and return how far the eyes have moved; nothing is changed."""
    watch = watch or SilentWatcher()
    started_ns = clock.now_ns()
    frames = _two_pictures(head, clock)
    shot = _Shot(head, calibration, clock=clock, watch=watch, settings=settings)
    places = shot.places(frames, started_ns=started_ns)
    duration_s = (clock.now_ns() - started_ns) / 1e9
    return judged(places, calibration, settings=settings, looks=shot.looks, duration_s=duration_s)


def judged(
    places: tuple[DriftPlace, ...],
    calibration: Calibration,
    *,
    settings: DriftSettings = DEFAULT,
    looks: int = 0,
    duration_s: float = 0.0,
) -> DriftCheck:
    """Return what the places say of the calibration that they were looked at with."""
    if not places:
        return _nothing(calibration, settings, looks=looks, duration_s=duration_s)
    fit = fit_drift(places, calibration, settings)
    marked = tuple(
        replace(place, agrees=bool(missed < AGREES)) for place, missed in zip(places, fit.missed, strict=True)
    )
    known = _vergence_known(marked, fit, calibration, settings)
    left, right = eye_drifts(*_kept(fit, vergence=known), calibration, settings)
    locked = _locked(marked, calibration, settings)
    significant = locked and (left.significant or right.significant)
    height = height_alone(fit) if locked and not significant else None
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
        vergence_sigma_rad=0.0 if known or not significant else _blind_sigma_rad(left.turn, right.turn),
        locked=locked,
        significant=significant,
        height_alone=height is not None,
        residual_px=fit.residual_px,
        duration_s=duration_s,
        detail="",
    )
    return replace(found, detail=words(found, settings=settings, f_px=calibration.fovea_f_px))


def applied(calibration: Calibration, found: DriftCheck, *, created_utc: str) -> Calibration:
    """Return the calibration corrected by a check, or itself where there is nothing to correct.

    What a check of one calibration found is applied to that one only: to its own outcome it adds nothing.
    Raise NotCalibrated without lock, or for another calibration.
    """
    if calibration.parent_id == found.calibration_id and calibration.origin == "corrected":
        return calibration
    if calibration.id != found.calibration_id:
        raise NotCalibrated(
            f"this drift check looked through calibration {found.calibration_id}, it cannot correct "
            f"{calibration.id}; check the drift again with the calibration in use"
        )
    if not found.locked:
        raise NotCalibrated(f"this drift check has no lock and corrects nothing: {found.detail}")
    if not found.significant:
        return calibration
    left, right = (_corrected_eye(calibration, found, role) for role in EYES)
    return replace(
        calibration,
        left=left,
        right=right,
        origin="corrected",
        created_utc=created_utc,
        parent_id=calibration.id,
    )


def _corrected_eye(calibration: Calibration, found: DriftCheck, role: Role) -> EyeCalibration:
    drift = found.eye(role)
    eye = turned_eye(calibration.eye(role), drift.turn, f_px=calibration.fovea_f_px)
    own = drift.sigma_px / calibration.fovea_f_px / math.sqrt(2.0)
    sigma_x, sigma_y = eye.mirror.sigma_rad
    if calibration.origin == "corrected":  # what an earlier correction stated, one that knows replaces
        sigma_x = max(min(sigma_x, sigma_y) if found.vergence_known else sigma_x, own)
        sigma_y = max(sigma_y, own)
    else:
        sigma_x, sigma_y = math.hypot(sigma_x, own), math.hypot(sigma_y, own)
    blind = math.sqrt(2.0) * found.vergence_sigma_rad
    return replace(eye, mirror=replace(eye.mirror, sigma_rad=(math.hypot(sigma_x, blind), sigma_y)))


class _Shot:
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
        self._looker = DriftPlaceFinder(head, calibration, settings)
        self._calibration = calibration
        self._clock = clock
        self._watch = watch
        self._settings = settings
        self._done: dict[int, DriftPlace] = {}

    @property
    def looks(self) -> int:
        """How many looks were taken."""
        return self._looker.looks

    def places(self, frames: tuple[Frame, Frame], *, started_ns: int) -> tuple[DriftPlace, ...]:
        """Return what was seen of each part of the field of regard, as far as there was time."""
        first, second = (gray(to_uint8(frame)) for frame in frames)
        field = DistinctnessMap.of((first, second), self._calibration, self._settings)
        known = known_spots(field, self._calibration, self._settings)
        queue = [*known, *spots(field, self._calibration, self._settings)]
        expected = DriftExpectation()
        total = len({spot.part for spot in queue})
        for spot in queue:
            check(self._watch, doing="the drift check")
            if spot.part in self._done:
                continue
            if self._late(started_ns):
                break
            self._measure(spot, expected)
            self._watch.progress(len(self._done), total=total, note=f"{self.looks} looks")
            self._watch.show("wide", drift_view(second, self._calibration, queue, set(self._done)))
        return tuple(self._done.values())

    def _late(self, started_ns: int) -> bool:
        """Return whether time is up: later without a lock than with one, for a machine that is slow."""
        took_s = (self._clock.now_ns() - started_ns) / 1e9
        if took_s <= self._settings.timeout_s:
            return False
        found = judged(tuple(self._done.values()), self._calibration, settings=self._settings)
        return found.locked or took_s > self._settings.longest_s

    def _measure(self, spot: DriftPatch, expected: DriftExpectation) -> None:
        place = self._looker.measure(spot, expected)
        if place is not None:
            self._done[spot.part] = place


def _two_pictures(head: Head, clock: Clock) -> tuple[Frame, Frame]:
    first = head.wide()
    clock.sleep_until_ns(clock.now_ns() + PAUSE_NS)
    return first, head.wide(max_age_ms=FRESH_MS)


def _nothing(
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
    told = any(place.inverse_depth is not None and place.agrees for place in places)
    apart_px = 2.0 * fit.vergence_sigma_rad * calibration.fovea_f_px
    return told and apart_px <= settings.vergence_sigma_px


def _kept(fit: DriftFit, *, vergence: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (12,) terms and their covariance; the angle between the eyes is left alone unless known."""
    if vergence:
        return fit.terms, fit.covariance
    along = np.zeros(2 * TERMS)
    along[[1, TERMS + 1]] = math.sqrt(0.5), -math.sqrt(0.5)
    keep = np.eye(2 * TERMS) - np.outer(along, along)
    return keep @ fit.terms, keep @ fit.covariance @ keep


def _locked(places: tuple[DriftPlace, ...], calibration: Calibration, settings: DriftSettings) -> bool:
    """Return whether enough places agree, spread over the field."""
    agreeing = np.array([place.target for place in places if place.agrees])
    if len(agreeing) < max(settings.least_places, settings.least_share * len(places)):
        return False
    field = field_of(calibration, Role.LEFT)
    return bool((np.ptp(agreeing, axis=0) > SPREAD * np.ptp(field, axis=0)).all())


def _blind_sigma_rad(left: EyeTurn, right: EyeTurn) -> float:
    """Return how much half the angle between the eyes may have changed, judged by what else has.

    A mount that gives way does so in every direction alike: the unseen part is as large as the seen ones.
    """
    across = (left.shift_rad[0] + right.shift_rad[0]) / 2.0
    each = math.sqrt((left.shift_rad[1] ** 2 + right.shift_rad[1] ** 2 + 2.0 * across**2) / 3.0)
    return each / math.sqrt(2.0)
