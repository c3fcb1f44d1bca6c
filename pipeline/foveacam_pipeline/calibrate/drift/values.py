"""Value types of a drift check: settings, measured places, turns of the eyes, and the result in sentences.

The fit, the procedure and the correction are in the sibling modules.
"""

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.verge.aim import EYES

TERMS = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeTurn:
    """How one eye has moved against its calibration.

    `turn_rad`: rotation vector about the rig's x, y and z; x > 0 raises the gaze, y > 0 turns it right, z > 0
    rolls the picture clockwise. `stretch`: relative growth of ax, of ay, and shear between them: the
    symmetric part of the linear term, which a turn cannot explain.
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


def turn_from_terms(terms: NDArray[np.float64]) -> EyeTurn:
    """Return the turn that has these (6,) terms."""
    x, y, z, grow_x, grow_y, shear = terms.tolist()
    return EyeTurn(turn_rad=(x, y, z), stretch=(grow_x, grow_y, shear))


def turn_slopes(tangents: NDArray[np.float64], turn: EyeTurn) -> NDArray[np.float64]:
    """Return the (n, 2, 6) derivatives of the true tangents by each term, at calibrated (n, 2) tangents."""
    step = 1e-6
    columns = []
    for term in range(TERMS):
        moved = turn.terms
        moved[term] += step
        before = turn.terms
        before[term] -= step
        columns.append(
            (turn_from_terms(moved).apply(tangents) - turn_from_terms(before).apply(tangents)) / (2.0 * step)
        )
    return np.stack(columns, axis=2)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftSettings:
    """Where a drift check looks and what it accepts. Wide px are px at the wide image's centre."""

    columns: int = 4
    rows: int = 4
    """Number of parts of the field of regard; one textured place is measured in each."""
    margin_rad: float = math.radians(0.7)
    """Distance of all places from the edge of the calibrated field, because the eyes may have drifted."""
    template_half_px: int = 16
    """Half side of a place's patch, wide px."""
    distance_m: float | None = None
    """Distance from the wide camera of the object in the middle of the wide view, when the operator knows it.
    The angle between the eyes can be checked only then, or with the marker target in view."""
    distance_rel_sigma: float = 2e-3
    """Relative standard error of that distance, as measured by tape."""
    layout: MarkerLayout | None = field(default_factory=MarkerLayout)
    """Layout of the marker target, whose distance is known when it is in view; None: not searched for."""
    timeout_s: float = 20.0
    """Time limit for measuring places once there is a lock, on the rig's clock."""
    longest_s: float = 120.0
    """Time limit without a lock: enough for a loaded computer that renders a simulated rig."""
    score: float = 0.55
    """Minimum correlation of each fovea with the wide patch."""
    fine_score: float = 0.7
    """Minimum correlation between the foveae."""
    fine_sigma_px: float = 0.4
    """Maximum error of the match between the foveae along the rows, fovea px."""
    placed_sigma_wide_px: float = 0.12
    """Standard error of a wide patch found again in both foveae together, each axis (rendered pairs)."""
    lens_sigma_wide_px: float = 0.05
    """Residual of the wide camera's model, the same for all places near each other."""
    turn_prior_rad: float = math.radians(1.0)
    roll_prior_rad: float = math.radians(0.5)
    stretch_prior: float = 2.5e-4
    """Prior standard deviations of the mount's turn and roll and of the mirror's gain."""
    least_places: int = 6
    least_share: float = 0.6
    """Number and share of the measured places that must agree for a lock."""
    significant: float = 3.0
    """A correction is applied when it moves the field by more than this many of its own standard errors."""
    vergence_sigma_px: float = 4.0
    """The angle between the eyes counts as known below this standard error, fovea px."""

    def __post_init__(self) -> None:
        if self.distance_m is not None and not (math.isfinite(self.distance_m) and self.distance_m > 0.5):
            raise InvalidInput(
                f"drift check: a distance of {self.distance_m} m was given; give the distance from the wide "
                "camera to the object in the middle of its view, more than 0.5 m, or none"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftPlace:
    """One scene point measured with both eyes, as (x, y) tangents in rig axes, each from its own centre.

    `target`: by the wide camera. `left`, `right`: by the calibration, under the volts in force, of the same
    point in each fovea. `inverse_depth`: 1 / Z, 1/m, and `inverse_sigma` its standard error where the depth
    is known otherwise than by the eyes. `sigma`: standard errors of the mean of the two eyes against the
    wide camera, and of left against right along x and along y.
    """

    target: tuple[float, float]
    left: tuple[float, float]
    right: tuple[float, float]
    sigma: tuple[float, float, float]
    score: float
    t_ns: int
    inverse_depth: float | None = None
    inverse_sigma: float = 0.0
    agrees: bool = True
    """Whether it agrees with the other places within its errors."""

    def seen(self, role: Role) -> NDArray[np.float64]:
        """Return the (2,) tangents at which an eye saw the point."""
        return np.array(self.left if role is Role.LEFT else self.right)


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeDrift:
    """Drift of one eye.

    `shift_sigma_rad`: standard errors of the shift at the middle of the field. `moved_px`, `sigma_px`: root
    mean square over the field of regard of the correction and of its standard error, fovea px.
    """

    turn: EyeTurn
    shift_sigma_rad: tuple[float, float]
    roll_sigma_rad: float
    moved_px: float
    sigma_px: float
    significant: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftCheck:
    """Result of one drift check.

    `vergence_known`: the horizontal difference between the eyes was measured; otherwise it was left
    unchanged, and `vergence_sigma_rad` is the standard error that this adds to each eye's ax. `locked`:
    enough places agree. `significant`: the correction exceeds its own standard error by enough to be applied.
    `residual_px`: residual of the fit, fovea px. `detail`: the result in sentences for the operator.
    """

    calibration_id: str
    rig_id: str
    places: tuple[DriftPlace, ...]
    looks: int
    left: EyeDrift
    right: EyeDrift
    vergence_known: bool
    vergence_sigma_rad: float
    locked: bool
    significant: bool
    residual_px: float
    duration_s: float
    detail: str
    height_alone: bool = False
    """Only the eyes' difference in height is significant, and only that is corrected."""

    def eye(self, role: Role) -> EyeDrift:
        """Return the drift of the left or the right eye."""
        return self.left if role is Role.LEFT else self.right

    @property
    def agreeing(self) -> int:
        """Number of places that agree."""
        return sum(place.agrees for place in self.places)


def describe_check(found: DriftCheck, *, settings: DriftSettings, f_px: float) -> str:
    """Return the result as sentences for the operator: findings, verdict, and what was not measured."""
    return " ".join(
        [
            _agreement_sentence(found),
            *(
                _height_sentence(found, f_px)
                if found.height_alone
                else (_eye_sentence(found, role) for role in EYES)
            ),
            _vergence_sentence(found, f_px),
            _verdict_sentence(found, settings),
        ]
    )


def _agreement_sentence(found: DriftCheck) -> str:
    return (
        f"{found.agreeing} of {len(found.places)} places agree, to {found.residual_px:.1f} fovea px, "
        f"after {found.looks} looks."
    )


def _eye_sentence(found: DriftCheck, role: Role) -> str:
    eye = found.eye(role)
    ax_deg, ay_deg = (math.degrees(angle) for angle in eye.turn.shift_rad)
    roll_deg = math.degrees(eye.turn.turn_rad[2])
    return (
        f"The {role} eye is off by {ax_deg:+.4f}° across, {ay_deg:+.4f}° down and {roll_deg:+.3f}° of roll: "
        f"{eye.moved_px:.1f} ± {eye.sigma_px:.1f} px over the field."
    )


def _height_sentence(found: DriftCheck, f_px: float) -> tuple[str]:
    apart_px = f_px * (found.right.turn.shift_rad[1] - found.left.turn.shift_rad[1])
    sigma_px = f_px * (found.left.shift_sigma_rad[1] + found.right.shift_sigma_rad[1])
    where = "lower" if apart_px > 0.0 else "higher"
    return (
        "Each eye looks where it should, within its own error, but the right one "
        f"{abs(apart_px):.1f} ± {sigma_px:.1f} px {where} than the left: that alone has drifted.",
    )


def _vergence_sentence(found: DriftCheck, f_px: float) -> str:
    if found.vergence_known:
        return "The angle between the eyes was checked at a known distance."
    unseen = (
        "The angle between the eyes cannot be separated from depth here and was not corrected: give the "
        "distance of the object in the middle of the view, or show the marker target"
    )
    if found.vergence_sigma_rad > 0.0:
        apart_px = 2.0 * found.vergence_sigma_rad * f_px
        return f"{unseen}; it may be wrong by ± {apart_px:.0f} px, which distances now state."
    return f"{unseen}."


def _verdict_sentence(found: DriftCheck, settings: DriftSettings) -> str:
    if not found.locked and found.duration_s > settings.longest_s:
        return (
            f"No lock: time was up after {found.duration_s:.0f} s; the cameras or the computer are too slow. "
            "End other programs on the computer, then check again."
        )
    if not found.locked:
        return (
            f"No lock: at least {settings.least_places} places all over the field must agree; look at a "
            "scene with more texture that stands still, or calibrate the mirrors again."
        )
    if found.significant:
        return "The drift is well beyond its standard error."
    return "The drift is within its standard error: nothing to correct."
