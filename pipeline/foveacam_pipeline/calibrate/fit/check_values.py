"""What a check of a calibration is asked for, and what it found at poses outside the sweep."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Sighting


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckSettings:
    """Where a check looks, and which matches count.

    The field of regard is parted into `columns` x `rows`; one textured place is looked at in each part.
    `margin_rad`: so far from the edge of the calibrated field. `apart_rad`: so far from every swept gaze.
    `score`, `sigma_px`: least correlation and largest error of a match of rows, fovea px. `timeout_s`: on the
    rig's clock.
    """

    columns: int = 7
    rows: int = 6
    margin_rad: float = math.radians(0.3)
    apart_rad: float = math.radians(0.15)
    score: float = 0.85
    sigma_px: float = 0.12
    timeout_s: float = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RowMatch:
    """One thing seen by both foveae. `gaze_rad`: mean (ax, ay) of the eyes. `offset_px`: from the gazes.

    `rows_px`: how much lower the left eye's rectified image shows it than the right one's, fovea px, and
    `sigma_px` the error of that match.
    """

    gaze_rad: tuple[float, float]
    offset_px: tuple[float, float]
    rows_px: float
    sigma_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PointingError:
    """How far from the wide camera's own view of a place the eyes see it, (x, y) fovea px, mean of both."""

    gaze_rad: tuple[float, float]
    missed_px: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CheckResult:
    """What a calibration leaves at places that it was not fitted to.

    `pointing_sigma_px`: error of measuring one pointing, both axes together; below it nothing can be said.
    `mosaic`: (h, w, 3) uint8 RGB, the wide view with the rectified foveae laid over it. `farthest`: the look
    farthest from the middle, for pictures.
    """

    calibration_id: str
    rows: tuple[RowMatch, ...]
    pointings: tuple[PointingError, ...]
    pointing_sigma_px: float
    looks: int
    mosaic: NDArray[np.uint8]
    farthest: Sighting | None

    @property
    def poses(self) -> int:
        """How many places were measured."""
        return len(self.pointings)

    @property
    def epipolar_rms_px(self) -> float | None:
        """Root mean square of the row differences, fovea px; None when nothing matched."""
        return _rms([match.rows_px for match in self.rows])

    @property
    def epipolar_p95_px(self) -> float | None:
        """95 % of the row differences are smaller."""
        sizes = [abs(match.rows_px) for match in self.rows]
        return float(np.quantile(sizes, 0.95)) if sizes else None

    @property
    def pointing_rms_px(self) -> float | None:
        """Root mean square of the pointing errors as distances, the measurement's own error included."""
        return _rms([math.hypot(*pointing.missed_px) for pointing in self.pointings])


def _rms(values: list[float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values else None
