"""What a drift check is asked for, what it saw, and what it found."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.drift.drift_turn import EyeTurn
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftSettings:
    """How a check looks, and how sure it must be. Wide px are px at the wide image's centre."""

    columns: int = 4
    rows: int = 4
    """The field of regard is parted so; one textured place is looked at in each part."""
    margin_rad: float = math.radians(0.7)
    """So far from the edge of the calibrated field places are chosen: the eyes may have drifted."""
    template_half_px: int = 16
    """Half side of a place's patch, wide px."""
    distance_m: float | None = None
    """Distance of what stands in the middle of the wide view, from the wide camera, when the operator knows
    it: then the angle between the eyes can be checked."""
    distance_rel_sigma: float = 2e-3
    """Standard error of that distance, as a share of it: a tape."""
    layout: MarkerLayout | None = field(default_factory=MarkerLayout)
    """The marker target that would tell a distance if it were in view; None: not looked for."""
    timeout_s: float = 20.0
    """No more places are looked at after that once there is a lock; on the rig's clock."""
    longest_s: float = 120.0
    """The same without a lock: what a computer takes that renders its own rig beside other work."""
    score: float = 0.55
    """Least correlation of each fovea with the wide patch."""
    fine_score: float = 0.7
    """Least correlation between the foveae."""
    fine_sigma_px: float = 0.4
    """Largest error of the match between the foveae along the rows, fovea px."""
    placed_sigma_wide_px: float = 0.12
    """How well a wide patch is found again in both foveae together, each axis (rendered pairs)."""
    lens_sigma_wide_px: float = 0.05
    """What the wide camera's model leaves, the same for all places near each other."""
    turn_prior_rad: float = math.radians(1.0)
    roll_prior_rad: float = math.radians(0.5)
    stretch_prior: float = 2.5e-4
    """What may be expected of a mount and of a mirror's gain before anything was seen, one sigma."""
    least_places: int = 6
    least_share: float = 0.6
    """Of the places that were measured so many must agree for a lock."""
    significant: float = 3.0
    """A correction is applied when it moves the field by so many of its own standard errors."""
    vergence_sigma_px: float = 4.0
    """The angle between the eyes counts as known below this standard error, fovea px."""

    def __post_init__(self) -> None:
        if self.distance_m is not None and not (math.isfinite(self.distance_m) and self.distance_m > 0.5):
            raise InvalidInput(
                f"drift check: a distance of {self.distance_m} m was told; give the distance from the wide "
                "camera to what stands in the middle of its view, more than 0.5 m, or none"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftPlace:
    """One place that both eyes were measured at; all are (x, y) tangents in rig axes, from each own centre.

    `target`: by the wide camera. `left`, `right`: by the calibration, under the volts in force, of the same
    thing in each fovea. `inverse_depth`: 1 / Z, 1/m, and `inverse_sigma` its standard error where the depth
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
    """Whether it fits the others within what may be expected."""

    def seen(self, role: Role) -> NDArray[np.float64]:
        """Return where an eye saw it, (2,) tangents."""
        return np.array(self.left if role is Role.LEFT else self.right)


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeDrift:
    """How far one eye has moved.

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
    """The outcome of one shot.

    `vergence_known`: the horizontal difference between the eyes was measured; otherwise it was left alone,
    and `vergence_sigma_rad` says by how much each eye's ax may be wrong on that account. `locked`: enough
    places agree. `significant`: the correction exceeds its own standard error enough to be applied.
    `residual_px`: what the fit leaves, fovea px. `detail`: all of it in sentences for the operator.
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
    """Each eye is within its own error, but how far apart they look in height is not: that alone is found."""

    def eye(self, role: Role) -> EyeDrift:
        """Return the left or the right eye's."""
        return self.left if role is Role.LEFT else self.right

    @property
    def agreeing(self) -> int:
        """How many places agree."""
        return sum(place.agrees for place in self.places)
