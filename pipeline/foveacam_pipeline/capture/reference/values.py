"""The settings of a reference, the rail's stated errors, and the results."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RailTrust:
    """Standard errors of the rail; zero means exact. All are estimated within these.

    `scale`: of its millimetre, relative. `lean_rad`: tilt of its axis against the rig's x, up and forward.
    `along_m`, `across_m`: of one stop, along and off the axis. `turn_rad`: of the rig at one stop, each
    axis.
    """

    scale: float = 2e-4
    lean_rad: float = 0.01
    along_m: float = 1e-4
    across_m: float = 1e-4
    turn_rad: float = 3e-5

    def __post_init__(self) -> None:
        """Refuse invalid standard errors."""
        for name in ("scale", "lean_rad", "along_m", "across_m", "turn_rad"):
            value = getattr(self, name)
            if not 0.0 <= value < 0.1:
                raise InvalidInput(
                    f"rail: a standard error {name} of {value} was given; 0 to 0.1 is possible"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceSettings:
    """Settings of a reference. `scan`: the judged one; None: the stop nearest to the middle of all.

    `bracket`: which exposure. `across`: samples over the width of a view; as dense down its height.
    """

    scan: int | None = None
    bracket: int = 0
    across: int = 10
    rail: RailTrust = field(default_factory=RailTrust)

    def __post_init__(self) -> None:
        """Refuse invalid settings."""
        if not 2 <= self.across <= 40:
            raise InvalidInput(f"{self.across} samples across a view were asked for; choose 2 to 40")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceSample:
    """One sample of a reference, a row of `samples.csv`.

    `point`: of the dataset, `right_point`: the point whose right fovea it was paired with; `x_px`, `y_px`:
    raw px of its left frame. Depths are along z of the rig at that scan's position on the rail, m.
    `short_m`: by that pair of 200 mm; its error from matching and from the pose, which is common to a look.
    `sigma_m`: total error of the reference; `own_sigma_m`: the part that its neighbours do not share.
    `views`, `stops`: number that agreed on it; `baseline_m`: the longest between two of them.
    `residual_px`: rms of their disagreement, fovea px.
    """

    point: int
    right_point: int
    x_px: float
    y_px: float
    ax_rad: float
    ay_rad: float
    short_m: float
    short_sigma_m: float
    short_pose_sigma_m: float
    reference_m: float
    sigma_m: float
    own_sigma_m: float
    views: int
    stops: int
    baseline_m: float
    residual_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StopFigures:
    """A stop of the rail as reported and as estimated, relative to the judged scan's stop.

    `place_m`: (x, y, z), m, rig frame; its standard errors. `turn_rad`: about x, y, z. `shift_px`: error of
    the gazes at this stop, (u, v) of the left and of the right eye, fovea px.
    """

    scan: int
    rail_m: float
    place_m: tuple[float, float, float]
    sigma_m: tuple[float, float, float]
    turn_rad: tuple[float, float, float]
    shift_px: tuple[float, float, float, float]
    observations: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthBin:
    """Samples of a range of depths, short baseline against reference.

    `expected_*`: Z^2 / (B f) |dd| of either baseline for the same |dd|. `reference_sigma_m`: as stated,
    rms; `reference_own_sigma_m`: the part that samples do not share. `depth_m`: median.
    """

    from_m: float
    to_m: float
    depth_m: float
    samples: int
    bias_m: float
    rms_m: float
    relative_rms: float
    expected_short_m: float
    expected_reference_m: float
    reference_sigma_m: float
    reference_own_sigma_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BaselineComparison:
    """The short baseline against the reference; `wrong`: share of samples that differ by more than 5 % of Z.

    Those are left out of the rest. `bias_rel`: median of Zs / Zr - 1. `disparity_rms_px`: |dd|, error of
    the short baseline's disparity, rms about its median; `disparity_bias_px`: that median.
    """

    samples: int
    wrong: float
    bias_rel: float
    rms_rel: float
    rms_m: float
    disparity_bias_px: float
    disparity_rms_px: float
    stated_sigma_rel: float
    bins: tuple[DepthBin, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceFigures:
    """Figures of a reference. `samples`: with short-baseline depth; `referenced`: of those, with a reference.

    `outliers`: share of matches that contradicted the rest. `residual_px`: rms distance between rays and
    points. `baseline_m`: median of the longest baselines.
    """

    scan: int
    baseline_m: float
    short_baseline_m: float
    points: int
    samples: int
    referenced: int
    matches: int
    outliers: float
    residual_px: float
    noise_factor: float
    stops: tuple[StopFigures, ...]
    comparison: BaselineComparison


@dataclass(frozen=True, slots=True, kw_only=True)
class WideBaselineReference:
    """A finished reference. `f_px`: focal length of the foveae."""

    figures: ReferenceFigures
    rows: tuple[ReferenceSample, ...]
    f_px: float
    recipe: Mapping[str, object]
