"""Correction of a calibration by a drift check: the models of each eye are turned as the eye has moved."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotCalibrated, Role
from foveacam_pipeline.calibrate.drift.values import DriftCheck, EyeTurn
from foveacam_pipeline.geometry.polynomial import BivariatePolynomial, fit_polynomial
from foveacam_pipeline.models.calibration import Calibration, EyeCalibration
from foveacam_pipeline.models.homography import HomographyField
from foveacam_pipeline.models.mirror import MirrorModel
from foveacam_pipeline.verge.aim import EYES

GRID = 25
"""Number of grid points along each axis at which a turned model is sampled for its refit."""
REFIT_PX = 0.02
"""Maximum residual of a refitted model at the grid points, fovea px; its order is raised until it is met."""
HIGHEST_ORDER = 12


def correct_calibration(calibration: Calibration, found: DriftCheck, *, created_utc: str) -> Calibration:
    """Return the calibration corrected by a check, or unchanged when the drift is not significant.

    The calibration that the check itself produced is returned unchanged. Raise NotCalibrated without lock, or
    for any other calibration than the one that was checked.
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
    eye = turn_eye(calibration.eye(role), drift.turn, f_px=calibration.fovea_f_px)
    own = drift.sigma_px / calibration.fovea_f_px / math.sqrt(2.0)
    sigma_x, sigma_y = eye.mirror.sigma_rad
    if calibration.origin == "corrected":
        # a check that knows the vergence replaces the error that an earlier one stated
        sigma_x = max(min(sigma_x, sigma_y) if found.vergence_known else sigma_x, own)
        sigma_y = max(sigma_y, own)
    else:
        sigma_x, sigma_y = math.hypot(sigma_x, own), math.hypot(sigma_y, own)
    blind = math.sqrt(2.0) * found.vergence_sigma_rad
    return replace(eye, mirror=replace(eye.mirror, sigma_rad=(math.hypot(sigma_x, blind), sigma_y)))


def turn_eye(eye: EyeCalibration, turn: EyeTurn, *, f_px: float) -> EyeCalibration:
    """Return the calibration of an eye after it turned; `f_px`: focal length of its virtual pinhole."""
    return replace(
        eye,
        mirror=_turned_mirror(eye.mirror, turn, f_px=f_px),
        homography=_turned_field(eye, turn, f_px=f_px),
    )


def _turned_mirror(mirror: MirrorModel, turn: EyeTurn, *, f_px: float) -> MirrorModel:
    volts = _grid(np.array([[-v, v] for v in mirror.max_v]))
    gaze = np.arctan(turn.apply(np.tan(mirror.forward(volts))))
    shift = turn.shift_rad
    inverse = mirror.inverse  # only the start of an iteration, so a shift is accurate enough
    centre = (inverse.centre[0] + shift[0], inverse.centre[1] + shift[1])
    return replace(
        mirror,
        forward=_refitted(mirror.forward.order, volts, gaze, tolerance=REFIT_PX / f_px, what="mirror"),
        inverse=replace(inverse, centre=centre),
        hull_rad=np.arctan(turn.apply(np.tan(mirror.hull_rad))),
    )


def _turned_field(eye: EyeCalibration, turn: EyeTurn, *, f_px: float) -> HomographyField:
    """Return the homography field turned with the eye.

    Only the rigid turn rotates the images; a stretch belongs to the mirror and deflects the gaze alone.
    """
    field = eye.homography
    rigid = EyeTurn(turn_rad=turn.turn_rad)
    hull = eye.mirror.hull_rad
    before = _grid(np.column_stack([hull.min(axis=0), hull.max(axis=0)]))
    after = np.arctan(rigid.apply(np.tan(before)))
    scale = np.diag([f_px, f_px, 1.0])
    plane = scale @ rigid.matrix @ np.linalg.inv(scale)
    entries = np.array(
        [
            _turned_entries(field, plane, f_px * np.tan(old), f_px * np.tan(new), old)
            for old, new in zip(before, after, strict=True)
        ]
    )
    # an entry has its full effect at one `scale_px` from the centre of the image
    polynomial = _refitted(
        field.polynomial.order, after, entries, tolerance=REFIT_PX / field.scale_px, what="homography"
    )
    return replace(field, polynomial=polynomial)


def _turned_entries(
    field: HomographyField,
    plane: NDArray[np.float64],
    gaze_px: NDArray[np.float64],
    turned_px: NDArray[np.float64],
    angles_rad: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the (6,) homography entries of one gaze, mapped to the plane, turned, about the new gaze."""
    ax_rad, ay_rad = angles_rad.tolist()
    relative = _translation(-turned_px) @ plane @ _translation(gaze_px) @ field.at(ax_rad, ay_rad)
    about_centre = relative @ _translation(np.array(field.centre_px))
    about_centre /= about_centre[2, 2]
    (a, b, _), (c, d, _), (e, f, _) = about_centre.tolist()
    return np.array([a, b, c, d, e * field.scale_px, f * field.scale_px])


def _refitted(
    order: int, at: NDArray[np.float64], values: NDArray[np.float64], *, tolerance: float, what: str
) -> BivariatePolynomial:
    """Return the polynomial of lowest order, at least `order`, that fits (n, m) values at (n, 2) points."""
    for richer in range(order, HIGHEST_ORDER + 1):
        fit = fit_polynomial(at, values, richer, loss="square")
        if float(np.abs(fit.residuals).max()) <= tolerance:
            return fit.polynomial
    raise NotCalibrated(
        f"the {what} model cannot be turned by so much: no polynomial up to order {HIGHEST_ORDER} holds it; "
        "calibrate the mirrors again"
    )


def _grid(spans: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (GRID², 2) knots over (2, 2) spans of x and y."""
    xs, ys = (np.linspace(low, high, GRID) for low, high in spans.tolist())
    return np.array([(x, y) for x in xs for y in ys])


def _translation(by: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[1.0, 0.0, float(by[0])], [0.0, 1.0, float(by[1])], [0.0, 0.0, 1.0]])
