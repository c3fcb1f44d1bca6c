"""What the 3D scene is told (the rig's shape, gazes, fixations), and its colours."""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.geometry.angles import ray
from foveacam_pipeline.stereo.values import Cloud, DepthMesh
from foveacam_pipeline.verge.values import Basis

Rgb: TypeAlias = tuple[int, int, int]

WIDE_COLOR: Rgb = (160, 160, 170)
LEFT_COLOR: Rgb = (78, 168, 255)
RIGHT_COLOR: Rgb = (255, 166, 64)
"""Left and right as in the page."""
TARGET_COLOR: Rgb = (79, 195, 201)
FOVEA_AND_WIDE_COLOR: Rgb = (226, 190, 84)
SURROUNDINGS_COLOR: Rgb = (178, 152, 240)
LIMITS_COLOR: Rgb = (226, 118, 106)
"""Targets by how their distance is known; `TARGET_COLOR`: by both foveae."""
SELECTED_COLOR: Rgb = (255, 64, 160)
MEASURE_COLOR: Rgb = (245, 215, 66)

LONGEST_NAME = 24
"""Characters of a target's name that the 3D scene shows; the page shows all of it."""
OPEN_ENDED = 3.0
"""A line without a farthest limit is drawn to so many times its nearest."""
DEFAULT_RAY_M = 10.0
"""How far a gaze ray is drawn while no distance is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RigShape:
    """The rig as drawn: foveae at -baseline/2 and +baseline/2, fields of view (horizontal, vertical)."""

    baseline_m: float
    wide_fov_rad: tuple[float, float]
    fovea_fov_rad: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeGaze:
    """Axis-wise direction of one fovea's centre in the rig frame."""

    ax_rad: float
    ay_rad: float


BASIS_COLORS = {
    Basis.BOTH_FOVEAE: TARGET_COLOR,
    Basis.FOVEA_AND_WIDE: FOVEA_AND_WIDE_COLOR,
    Basis.SURROUNDINGS: SURROUNDINGS_COLOR,
    Basis.BOUND: LIMITS_COLOR,
}
BASIS_WORDS = {Basis.FOVEA_AND_WIDE: "one fovea and wide", Basis.SURROUNDINGS: "from surroundings"}
"""What a label adds to a distance that both foveae did not measure."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationDrawing:
    """One fixation in the scene."""

    label: str
    point_rig_m: tuple[float, float, float]
    distance_m: float
    distance_sigma_m: float
    basis: Basis = Basis.BOTH_FOVEAE
    cloud: Cloud | None = None
    mesh: DepthMesh | None = None

    @property
    def text(self) -> str:
        """The label as shown: name, distance and its standard error, to the digits that mean something."""
        digits = next((k for k in (1, 2, 3) if self.distance_sigma_m >= 10.0**-k), 4)
        known = f"  {self.distance_m:.{digits}f} ± {self.distance_sigma_m:.{digits}f} m"
        words = BASIS_WORDS.get(self.basis)
        return short(self.label) + known + (f" ({words})" if words else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementDrawing:
    """A measurement in the scene: one point, a line of two, or the outline of a plane (`closed`)."""

    label: str
    points_rig_m: tuple[tuple[float, float, float], ...]
    closed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitsDrawing:
    """A fixation of which only limits of the distance are known; `farthest_m` None: there is none."""

    label: str
    direction_deg: tuple[float, float]
    nearest_m: float
    farthest_m: float | None

    @property
    def text(self) -> str:
        """The label as shown: name and limits."""
        limits = f"> {self.nearest_m:.1f} m"
        if self.farthest_m is not None:
            limits = f"{self.nearest_m:.1f} to {self.farthest_m:.1f} m"
        return f"{short(self.label)}  {limits}"

    def ends_rig_m(self) -> NDArray[np.float64]:
        """Return (2, 3) the ends of the line; an open one ends at `OPEN_ENDED` times its nearest."""
        ax_deg, ay_deg = self.direction_deg
        sight = np.asarray(ray(math.radians(ax_deg), math.radians(ay_deg)))
        end_m = OPEN_ENDED * self.nearest_m if self.farthest_m is None else self.farthest_m
        return np.stack((self.nearest_m * sight, end_m * sight))


def short(name: str) -> str:
    """Return a target's name, cut to what the scene shows."""
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
