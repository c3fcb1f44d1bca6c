"""The values that the 3D scene draws (rig shape, gazes, fixations, measurements), and its colours."""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.geometry.angles import ray
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from foveacam_pipeline.verge.values import Basis

Point: TypeAlias = tuple[float, float, float]
"""x, y, z in metres, rig frame."""
Rgb: TypeAlias = tuple[int, int, int]
UP: Point = (0.0, -1.0, 0.0)

WIDE_COLOR: Rgb = (160, 160, 170)
LEFT_COLOR: Rgb = (78, 168, 255)
RIGHT_COLOR: Rgb = (255, 166, 64)
"""Colours of left and right, the same as in the console."""
TARGET_COLOR: Rgb = (79, 195, 201)
FOVEA_AND_WIDE_COLOR: Rgb = (226, 190, 84)
SURROUNDINGS_COLOR: Rgb = (178, 152, 240)
LIMITS_COLOR: Rgb = (226, 118, 106)
"""Colours of targets by the basis of their distance; `TARGET_COLOR`: both foveae."""
SELECTED_COLOR: Rgb = (255, 64, 160)
MEASURE_COLOR: Rgb = (245, 215, 66)

LONGEST_NAME = 24
"""Characters of a target's name that the 3D scene shows; the console shows all of them."""
OPEN_ENDED = 3.0
"""Multiple of the nearest limit at which a line without a farthest limit ends."""
DEFAULT_RAY_M = 10.0
"""Length of a gaze ray while no distance is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RigShape:
    """Shape of the rig: foveae at x = -baseline/2 and +baseline/2, fields of view (horizontal, vertical)."""

    baseline_m: float
    wide_fov_rad: tuple[float, float]
    fovea_fov_rad: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeGaze:
    """Axis-wise direction of the centre of one fovea's view, rig frame."""

    ax_rad: float
    ay_rad: float


BASIS_COLORS = {
    Basis.BOTH_FOVEAE: TARGET_COLOR,
    Basis.FOVEA_AND_WIDE: FOVEA_AND_WIDE_COLOR,
    Basis.SURROUNDINGS: SURROUNDINGS_COLOR,
    Basis.BOUND: LIMITS_COLOR,
}
BASIS_WORDS = {Basis.FOVEA_AND_WIDE: "one fovea", Basis.SURROUNDINGS: "inferred"}
"""Words that a label adds to a distance not measured by both foveae."""


def metres_text(value_m: float, sigma_m: float) -> str:
    """Return a length with its standard error, to the first digit of that, 0.01 mm at most."""
    digits = next((k for k in (1, 2, 3, 4) if sigma_m >= 10.0**-k), 5)
    return f"{value_m:.{digits}f} ± {sigma_m:.{digits}f} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationDrawing:
    """A fixation with a distance, as drawn in the scene."""

    label: str
    point_rig_m: Point
    distance_m: float
    distance_sigma_m: float
    basis: Basis = Basis.BOTH_FOVEAE
    cloud: Cloud | None = None
    mesh: DepthMesh | None = None

    @property
    def text(self) -> str:
        """The label's text: name, distance and its standard error."""
        known = f"  {metres_text(self.distance_m, self.distance_sigma_m)}"
        words = BASIS_WORDS.get(self.basis)
        return short(self.label) + known + (f" ({words})" if words else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementDrawing:
    """A measurement as drawn in the scene: one point, a line of two, or a plane's outline (`closed`)."""

    label: str
    points_rig_m: tuple[Point, ...]
    closed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitsDrawing:
    """A fixation with only limits of its distance; `farthest_m` None: no farthest limit."""

    label: str
    direction_deg: tuple[float, float]
    nearest_m: float
    farthest_m: float | None

    @property
    def text(self) -> str:
        """The label's text: name and limits."""
        limits = f"> {self.nearest_m:.1f} m"
        if self.farthest_m is not None:
            limits = f"{self.nearest_m:.1f} to {self.farthest_m:.1f} m"
        return f"{short(self.label)}  {limits}"

    def ends_rig_m(self) -> NDArray[np.float64]:
        """Return the ends of the line, (2, 3) float64, m, rig frame; see `OPEN_ENDED`."""
        ax_deg, ay_deg = self.direction_deg
        sight = np.asarray(ray(math.radians(ax_deg), math.radians(ay_deg)))
        end_m = OPEN_ENDED * self.nearest_m if self.farthest_m is None else self.farthest_m
        return np.stack((self.nearest_m * sight, end_m * sight))


def short(name: str) -> str:
    """Return a target's name, cut to `LONGEST_NAME` characters."""
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
