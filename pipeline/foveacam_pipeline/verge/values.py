"""Value types of a fixation: its target, its steps and its result."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from foveacam_hardware.contract import Sighting, StereoVolts
from foveacam_pipeline.verge.matching.target_offset import TargetOffset


class FixationState(StrEnum):
    """How a fixation ended."""

    VERGED = "verged"
    NO_TEXTURE = "no_texture"
    LOST = "lost"
    OUT_OF_RANGE = "out_of_range"
    TIMED_OUT = "timed_out"


class Basis(StrEnum):
    """How the distance of a fixation is known."""

    BOTH_FOVEAE = "both_foveae"
    """Left against right, baseline 0.2 m, confirmed by the wide view."""
    FOVEA_AND_WIDE = "fovea_and_wide"
    """One fovea against the wide camera, baseline 0.1 m: the other eye cannot see the point."""
    SURROUNDINGS = "surroundings"
    """Inferred from measured neighbours: the point itself has nothing that could be matched."""
    BOUND = "bound"
    """No distance, only limits of it."""


class VergePhase(StrEnum):
    """What one step of the loop did."""

    PARALLEL = "parallel"
    EPIPOLAR = "epipolar"
    COARSE = "coarse"
    FINE = "fine"
    SURROUNDINGS = "surroundings"


@dataclass(frozen=True, slots=True, kw_only=True)
class PixelTarget:
    """A point of the wide image, px (centre of the first pixel is 0, 0)."""

    x_px: float
    y_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RectangleTarget:
    """A rectangle of the wide image, px; its corner is the one nearest to the origin."""

    x_px: float
    y_px: float
    width_px: float
    height_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionTarget:
    """A direction in the rig frame, axis-wise radians."""

    ax_rad: float
    ay_rad: float


Target: TypeAlias = PixelTarget | RectangleTarget | DirectionTarget


@dataclass(frozen=True, slots=True, kw_only=True)
class VergeStep:
    """One look of the loop: where the eyes pointed, and what was matched there."""

    index: int
    phase: VergePhase
    left_ax_rad: float
    left_ay_rad: float
    right_ax_rad: float
    right_ay_rad: float
    residual_x_px: float | None
    """Left minus right place of the target in the foveae along the epipolar line, fovea px, if found."""
    residual_y_px: float | None
    score: float
    """Normalised cross-correlation of the match that this step used, -1..1."""
    compute_ms: float
    """Computing time of this step, without frames and settling."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceRange:
    """Distances from the rig's origin at which a target may lie, m; `farthest_m` may be infinite."""

    nearest_m: float
    farthest_m: float

    def holds(self, distance_m: float) -> bool:
        """Return whether a distance lies in the range."""
        return self.nearest_m <= distance_m <= self.farthest_m

    def span_per_m(self, *, nearest_m: float) -> tuple[float, float]:
        """Return the least and the largest 1/Z to search, taking distance for depth (equal within 3 %).

        `nearest_m`: nothing nearer is searched in any case.
        """
        return 1.0 / self.farthest_m, 1.0 / max(self.nearest_m, nearest_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceBound:
    """Limits of a distance from the rig's origin, metres; `farthest_m` is infinite when there is none."""

    nearest_m: float
    farthest_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternative:
    """One of several distances that a target may have.

    The probabilities of all add up to 1, or to less where it may have none of them.
    """

    basis: Basis
    distance_m: float
    distance_sigma_m: float
    point_rig_m: tuple[float, float, float]
    probability: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeView:
    """What one fovea shows at the end of a fixation.

    `sees_target`: whether it shows the target. `reason`: one sentence when it does not, else empty.
    """

    sees_target: bool
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fixation:
    """The answer to one target.

    `state` is how the closed loop of both foveae ended; `basis` is how the distance is known, even where the
    loop failed. `distance_m` is the distance of the point from the rig's origin (the wide camera's centre);
    `point_rig_m` is (X, Y, Z) in the rig frame. All three are None when `basis` is `bound` or None.
    """

    state: FixationState
    reason: str
    """One sentence for the operator: why it ended like this, and what would help."""
    target_ax_rad: float
    target_ay_rad: float
    steps: tuple[VergeStep, ...]
    target_moved: bool = False
    """Whether the target was seen to move since it was chosen: its direction above is then an earlier one."""
    distance_m: float | None = None
    distance_sigma_m: float | None = None
    distance_sigma_random_m: float | None = None
    """The part of the error that differs from look to look; None where it is not known."""
    point_rig_m: tuple[float, float, float] | None = None
    basis: Basis | None = None
    bound: DistanceBound | None = None
    """Set when `basis` is `bound`."""
    alternatives: tuple[Alternative, ...] = ()
    """Empty, or at least two, the most probable first: that one is the answer above."""
    left_view: EyeView | None = None
    right_view: EyeView | None = None
    residual_px: float | None = None
    score: float | None = None
    volts: StereoVolts | None = None
    sighting: Sighting | None = None
    """The last look, from which depth is computed."""
    target_offset: TargetOffset | None = None
    """Offset of a target that both eyes show away from its place, which means that the mounts have moved."""
    duration_ms: float = 0.0
