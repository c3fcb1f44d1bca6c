"""What the 3D scene is told (the rig's shape, gazes, fixations), and its colours."""

from dataclasses import dataclass
from typing import TypeAlias

from foveacam_pipeline.stereo.values import Cloud, DepthMesh

Rgb: TypeAlias = tuple[int, int, int]

WIDE_COLOR: Rgb = (160, 160, 170)
LEFT_COLOR: Rgb = (78, 168, 255)
RIGHT_COLOR: Rgb = (255, 166, 64)
"""Left and right as in the page."""
TARGET_COLOR: Rgb = (79, 195, 201)
SELECTED_COLOR: Rgb = (255, 64, 160)
MEASURE_COLOR: Rgb = (245, 215, 66)

LONGEST_NAME = 24
"""Characters of a target's name that the 3D scene shows; the page shows all of it."""
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


@dataclass(frozen=True, slots=True, kw_only=True)
class FixationDrawing:
    """One fixation in the scene."""

    label: str
    point_rig_m: tuple[float, float, float]
    distance_m: float
    distance_sigma_m: float
    cloud: Cloud | None = None
    mesh: DepthMesh | None = None

    @property
    def text(self) -> str:
        """The label as shown: name, distance and its standard error, to the digits that mean something."""
        digits = 1 if self.distance_sigma_m >= 0.1 else 2 if self.distance_sigma_m >= 0.01 else 3
        name = self.label if len(self.label) <= LONGEST_NAME else f"{self.label[: LONGEST_NAME - 1]}…"
        return f"{name}  {self.distance_m:.{digits}f} ± {self.distance_sigma_m:.{digits}f} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementDrawing:
    """A measurement in the scene: one point, a line of two, or the outline of a plane (`closed`)."""

    label: str
    points_rig_m: tuple[tuple[float, float, float], ...]
    closed: bool = False
