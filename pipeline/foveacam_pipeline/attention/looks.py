"""Candidate looks: where each eye may turn, which cells it shows there, and how well they are measured."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Role
from foveacam_pipeline.attention.field import Bools, FieldGrid, Floats
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import EYES, Gazes, gaze_at, reach_span
from foveacam_pipeline.wide_depth.looks import LEAST_OVERLAP, overlap_share
from foveacam_pipeline.wide_depth.wide_matches import NEAREST_M

STEP = 0.5
"""Distance of neighbouring candidates as a share of a fovea's field."""
SHOWN = 0.9
"""Share of its width and height that a fovea shows reliably: the rest is lost by roll and by the matcher."""
ONE_EYE_SIGMA_PX, BOTH_SIGMA_PX = 0.22, 0.2
"""Usual standard errors of a match, beside the calibration's: of one fovea with the wide view, px of that
frame, and between the foveae, px of the sensor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookErrors:
    """Standard errors of 1/Z, 1/m: of one fovea against the wide view, and of both foveae."""

    one_eye_per_m: float
    both_per_m: float

    @classmethod
    def of(cls, calibration: Calibration, *, binning: Binning) -> "LookErrors":
        """Return the errors that matcher and calibration state at 4 m, from frames of a binning."""
        depth_m = 4.0
        match_rad = ONE_EYE_SIGMA_PX * binning / calibration.wide.fx_px
        pose_rad = max(calibration.eye(role).angle_sigma_rad(depth_m)[0] for role in EYES)
        both_px = math.hypot(BOTH_SIGMA_PX, calibration.pose_sigma_px(depth_m))
        return cls(
            one_eye_per_m=math.hypot(match_rad, pose_rad) / (0.5 * calibration.baseline_m),
            both_per_m=both_px / (calibration.fovea_f_px * calibration.baseline_m),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shown:
    """The cells that candidates show, (c, n) bool for each eye; `both`: where both foveae overlap."""

    left: Bools
    right: Bools
    both: Bools


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GazeGrid:
    """The gazes that one eye may take: a grid of tangents; `reached`: (b, a) bool, by its mirror."""

    x: Floats
    y: Floats
    reached: Bools

    def gaze(self, index: int) -> Floats:
        """Return (2,) the gaze of a flat index."""
        row, column = divmod(index, len(self.x))
        return np.array([self.x[column], self.y[row]])


class Candidates:
    """The gazes of a rig's eyes that are tried, and the cells that they show."""

    def __init__(self, calibration: Calibration, grid: FieldGrid, *, binning: Binning = 1) -> None:
        self.calibration = calibration
        self.grid = grid
        self.errors = LookErrors.of(calibration, binning=binning)
        size = np.array([calibration.fovea_width, calibration.fovea_height]) / calibration.fovea_f_px
        self.half_view = SHOWN * size / 2.0
        """(2,) half of what a fovea shows reliably, tangents."""
        self._step = STEP * size

    def set_binning(self, binning: Binning) -> None:
        """Expect the errors of frames of a binning."""
        self.errors = LookErrors.of(self.calibration, binning=binning)

    @cached_property
    def gazes(self) -> dict[Role, GazeGrid]:
        """Return the gazes that each eye may take by itself."""
        return {role: self._gazes_of(role) for role in EYES}

    @cached_property
    def directions(self) -> Floats:
        """Return (c, 2) tangents from the origin at which both eyes verge at some depth."""
        x, y = self._axes(self.grid.tangents.min(axis=0), self.grid.tangents.max(axis=0))
        spread = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        nearest = 1.0 / NEAREST_M
        return spread[[reach_span(self.calibration, one, nearest=nearest) is not None for one in spread]]

    @cached_property
    def near_directions(self) -> NDArray[np.float32]:
        """Return (c, n) 1.0 for the cells within a fovea's view about each of `directions`, else 0.0."""
        aside = np.abs(self.grid.tangents[None] - self.directions[:, None])
        return np.asarray((aside <= self.half_view).all(axis=2), dtype=np.float32)

    def worths(self, role: Role, inverse_z_per_m: Floats, cell_worths: Floats) -> Floats:
        """Return (b, a) the sum of (n,) worths over the cells that each gaze of an eye's grid shows."""
        cells, half, grid = self._cell_gazes(role, inverse_z_per_m), self.half_view, self.gazes[role]
        across = np.abs(cells[None, :, 0] - grid.x[:, None]) <= half[0]
        down = np.abs(cells[None, :, 1] - grid.y[:, None]) <= half[1]
        return np.asarray((down * cell_worths) @ across.T.astype(np.float64), dtype=np.float64)

    def shows(self, role: Role, gazes: Floats, inverse_z_per_m: Floats) -> Bools:
        """Return (c, n) bool: which cells an eye shows under gazes (c, 2)."""
        cells, half = self._cell_gazes(role, inverse_z_per_m), self.half_view
        across = np.abs(cells[None, :, 0] - gazes[:, None, 0]) <= half[0]
        down = np.abs(cells[None, :, 1] - gazes[:, None, 1]) <= half[1]
        return np.asarray(across & down, dtype=np.bool_)

    def reaches(self, role: Role, gazes: Floats) -> Bools:
        """Return (c,) bool: which gazes (c, 2) an eye's mirror reaches."""
        return self.calibration.eye(role).mirror.inside(np.arctan(gazes))

    def verged(self, directions: Floats, inverse_z: Floats) -> Gazes:
        """Return both eyes' gazes, (c, 2) each, that meet on directions (c, 2) at 1/Z (c,)."""
        left, right = (
            gaze_at(self.calibration, role, directions, inverse_z[:, None])
            for role in (Role.LEFT, Role.RIGHT)
        )
        return Gazes(left=left, right=right)

    def shown_by(self, gazes: Gazes, inverse_z: Floats, *, inverse_z_per_m: Floats) -> Shown:
        """Return the cells that verged looks show; `inverse_z`: (c,) at which the gazes meet."""
        left = self.shows(Role.LEFT, gazes.left, inverse_z_per_m)
        right = self.shows(Role.RIGHT, gazes.right, inverse_z_per_m)
        apart = inverse_z_per_m[None] - inverse_z[:, None]
        overlap = overlap_share(apart, self.calibration) >= LEAST_OVERLAP
        return Shown(left=left, right=right, both=left & right & overlap)

    def shown_under(self, gazes: Gazes, inverse_z_per_m: Floats) -> Bools:
        """Return (n,) bool: the cells that either eye shows under its gaze, (2,) each."""
        left, right = (self.shows(role, gazes.eye(role)[None], inverse_z_per_m)[0] for role in EYES)
        return np.asarray(left | right, dtype=np.bool_)

    def _cell_gazes(self, role: Role, inverse_z_per_m: Floats) -> Floats:
        """Return (n, 2) the gaze of an eye at each cell."""
        return gaze_at(self.calibration, role, self.grid.tangents, inverse_z_per_m[:, None])

    def _gazes_of(self, role: Role) -> GazeGrid:
        """Return the gazes over the mirror's field, as far as they show cells of the wide view."""
        hull = np.tan(self.calibration.eye(role).mirror.hull_rad)
        ends = [self._cell_gazes(role, np.full(len(self.grid), q)) for q in (0.0, 1.0 / NEAREST_M)]
        seen = np.concatenate(ends)
        low = np.maximum(hull.min(axis=0), seen.min(axis=0))
        high = np.minimum(hull.max(axis=0), seen.max(axis=0))
        x, y = self._axes(low, high)
        every = np.stack(np.meshgrid(x, y), axis=-1)
        reached = self.reaches(role, every.reshape(-1, 2)).reshape(every.shape[:2])
        return GazeGrid(x=x, y=y, reached=reached)

    def _axes(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        counts = np.maximum(1, np.ceil((high - low) / self._step).astype(np.int64)) + 1
        return np.linspace(low[0], high[0], counts[0]), np.linspace(low[1], high[1], counts[1])
