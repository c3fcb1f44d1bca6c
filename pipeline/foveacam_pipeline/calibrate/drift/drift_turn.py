"""What happens to an eye when its mount gives way: it turns as a whole, and its angles stretch a little.

A turn is a rotation vector about the rig's x, y and z; x > 0 raises the gaze, y > 0 turns it right, z > 0
rolls the picture clockwise. A stretch is the symmetric rest of the linear term: what a turn cannot explain.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import NotCalibrated
from foveacam_pipeline.geometry.polynomial import BivariatePolynomial, fit_polynomial
from foveacam_pipeline.models.calibration import EyeCalibration
from foveacam_pipeline.models.homography import HomographyField
from foveacam_pipeline.models.mirror import MirrorModel

TERMS = 6
GRID = 25
"""Knots an axis on which a turned model is drawn before it is fitted again."""
REFIT_PX = 0.02
"""A turned model is refitted until no knot misses by more, fovea px."""
HIGHEST_ORDER = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeTurn:
    """How one eye has moved against its calibration.

    `turn_rad`: rotation vector, rig axes. `stretch`: relative growth of ax, of ay, and shear between them.
    """

    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stretch: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def terms(self) -> NDArray[np.float64]:
        """(6,) turn and stretch."""
        return np.array([*self.turn_rad, *self.stretch])

    @property
    def shift_rad(self) -> tuple[float, float]:
        """(ax, ay) by which the gaze at the middle of the field has moved."""
        return self.turn_rad[1], -self.turn_rad[0]

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(3, 3) rotation: true from calibrated directions."""
        return np.asarray(cv2.Rodrigues(np.array(self.turn_rad))[0], dtype=np.float64)

    def apply(self, tangents: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the true (n, 2) tangents of calibrated ones, (n, 2)."""
        grow_x, grow_y, shear = self.stretch
        angles = np.arctan(tangents)
        stretched = np.tan(angles + angles @ np.array([[grow_x, shear], [shear, grow_y]]))
        rays = np.column_stack([stretched, np.ones(len(tangents))]) @ self.matrix.T
        return np.asarray(rays[:, :2] / rays[:, 2:], dtype=np.float64)


def turn_of(terms: NDArray[np.float64]) -> EyeTurn:
    """Return the EyeTurn of (6,) terms."""
    x, y, z, grow_x, grow_y, shear = terms.tolist()
    return EyeTurn(turn_rad=(x, y, z), stretch=(grow_x, grow_y, shear))


def slopes(tangents: NDArray[np.float64], turn: EyeTurn) -> NDArray[np.float64]:
    """Return (n, 2, 6): how true tangents change with each term, at calibrated (n, 2) tangents."""
    step = 1e-6
    columns = []
    for term in range(TERMS):
        moved = turn.terms
        moved[term] += step
        before = turn.terms
        before[term] -= step
        columns.append((turn_of(moved).apply(tangents) - turn_of(before).apply(tangents)) / (2.0 * step))
    return np.stack(columns, axis=2)


def turned_eye(eye: EyeCalibration, turn: EyeTurn, *, f_px: float) -> EyeCalibration:
    """Return the calibration of an eye that has moved so; `f_px`: focal length of its virtual pinhole."""
    return replace(
        eye,
        mirror=_turned_mirror(eye.mirror, turn, f_px=f_px),
        homography=_turned_field(eye, turn, f_px=f_px),
    )


def _turned_mirror(mirror: MirrorModel, turn: EyeTurn, *, f_px: float) -> MirrorModel:
    volts = _grid(np.array([[-v, v] for v in mirror.max_v]))
    gaze = np.arctan(turn.apply(np.tan(mirror.forward(volts))))
    shift = turn.shift_rad
    inverse = mirror.inverse  # the start of an iteration: what it lacks is found there
    centre = (inverse.centre[0] + shift[0], inverse.centre[1] + shift[1])
    return replace(
        mirror,
        forward=_refitted(mirror.forward.order, volts, gaze, tolerance=REFIT_PX / f_px, what="mirror"),
        inverse=replace(inverse, centre=centre),
        hull_rad=np.arctan(turn.apply(np.tan(mirror.hull_rad))),
    )


def _turned_field(eye: EyeCalibration, turn: EyeTurn, *, f_px: float) -> HomographyField:
    """Turn the pictures with the eye: where it now looks, it sees as it saw before, turned.

    A stretch is the mirror's own: it bends the light as much farther as its angle says, and turns nothing.
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
    # an entry is felt in full at one scale from the centre of the image
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
    """Return the (6,) entries of one gaze: to the plane, turned there, and counted from the new gaze."""
    ax_rad, ay_rad = angles_rad.tolist()
    relative = _moved(-turned_px) @ plane @ _moved(gaze_px) @ field.at(ax_rad, ay_rad)
    about_centre = relative @ _moved(np.array(field.centre_px))
    about_centre /= about_centre[2, 2]
    (a, b, _), (c, d, _), (e, f, _) = about_centre.tolist()
    return np.array([a, b, c, d, e * field.scale_px, f * field.scale_px])


def _refitted(
    order: int, at: NDArray[np.float64], values: NDArray[np.float64], *, tolerance: float, what: str
) -> BivariatePolynomial:
    """Return the polynomial through (n, m) values at (n, 2) places, of the lowest order from `order` on."""
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


def _moved(by: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[1.0, 0.0, float(by[0])], [0.0, 1.0, float(by[1])], [0.0, 0.0, 1.0]])
