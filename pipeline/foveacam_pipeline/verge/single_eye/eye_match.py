"""One fovea against the wide camera: the distance of what only one eye can see (baseline 0.1 m).

A target along the tangents (tx, ty) at inverse depth q = 1/Z lies at (tx ± B/2 q, ty) on the virtual plane of
the left (+) and of the right (-) eye. The patch of the wide image is correlated with one fovea along that
line; each peak is then registered to a fraction of a pixel. Both pictures are compared at survey scale.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.matching.correlation import UNSEEN, score_map
from foveacam_pipeline.matching.picture import InterpolatedPicture, WindowPlacement
from foveacam_pipeline.matching.windows import MatchWindow
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.matching.match_in_rows import SubpixelPosition, match_in_rows
from foveacam_pipeline.verge.matching.survey import ReducedEye
from foveacam_pipeline.verge.matching.wide_patch import WidePatch

ROWS_PX = 5
"""Largest distance of a target above or below its row, survey px."""
ROW_PENALTY = 0.04
"""Penalty on the correlation at the edge of these rows."""
GUARD_PX = 5.0
"""Least distance between two peaks along the line, survey px."""
PEAKS = 3
LEAST_SCORE = 0.4
"""A peak below this correlation is not registered."""
WINDOWS = (MatchWindow(half_px=24, weight_sigma_px=10.0), MatchWindow(half_px=40, weight_sigma_px=18.0))
"""Windows of the registration, survey px; the second is used where the first is ambiguous."""
MARGIN_PX = 12
PLACED_SIGMA_PX = 0.12
"""Error of a registration besides that due to noise, survey px: measured on rendered clicks."""
SHARED_SIGMA_PX = 0.2
"""Error that both eyes share, survey px: texture finer than a wide pixel. The calibration states the drift of
the mounts. 49 clicks anywhere want 0.16, twelve on such texture more."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CorrelationProfile:
    """Correlation of the wide patch with one fovea against inverse depth.

    `inverse_z_per_m`: (n,) ascending. `scores`: (n,), `UNSEEN` outside the fovea's field.
    """

    inverse_z_per_m: NDArray[np.float64]
    scores: NDArray[np.float64]

    def peaks(self, *, step_px: float) -> list[tuple[float, float]]:
        """Return (inverse depth, score) of the best separate peaks; `step_px` is the entries' spacing."""
        left = self.scores.copy()
        found: list[tuple[float, float]] = []
        guard = max(1, round(GUARD_PX / step_px))
        for _ in range(PEAKS):
            best = int(np.argmax(left))
            if left[best] < LEAST_SCORE:
                break
            found.append((float(self.inverse_z_per_m[best]), float(left[best])))
            left[max(0, best - guard) : best + guard + 1] = UNSEEN
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeMatch:
    """Match of the target in one fovea.

    `inverse_z_per_m`, `sigma_per_m`: 1/Z and its standard error. `score`: weighted correlation with the wide
    view. `row_px`: how much lower than expected it lies, survey px.
    """

    role: Role
    inverse_z_per_m: float
    sigma_per_m: float
    score: float
    row_px: float


def side_of(role: Role) -> float:
    """Return +1 for the left eye, in which near things lie further right, and -1 for the right one."""
    return 1.0 if role is Role.LEFT else -1.0


def profile_of(
    eye: ReducedEye,
    role: Role,
    template: WidePatch,
    target: NDArray[np.float64],
    *,
    inverse_z_per_m: NDArray[np.float64],
    baseline_m: float,
) -> CorrelationProfile:
    """Correlate a patch with one fovea at each inverse depth, (n,). `target`: (2,) tangents."""
    scores = np.full(len(inverse_z_per_m), UNSEEN)
    height, width = template.patch.shape
    half_x, half_y = (width - 1) // 2, (height - 1) // 2
    row = round(float(target[1]) * template.f_px - eye.v0_px) - half_y
    first, last = max(0, row - ROWS_PX), min(eye.image.shape[0] - height + 1, row + ROWS_PX + 1)
    if last <= first or eye.image.shape[1] < width:
        return CorrelationProfile(inverse_z_per_m=inverse_z_per_m, scores=scores)
    offsets = (np.arange(first, last) - row) / ROWS_PX
    loss = ROW_PENALTY * (offsets * offsets)[:, None]
    band = score_map(eye.image[first : last + height - 1], template.patch) - loss
    band[eye.hidden(template.patch.shape, slice(first, last))] = UNSEEN
    u_px = template.f_px * (target[0] + side_of(role) * 0.5 * baseline_m * inverse_z_per_m)
    columns = u_px - eye.u0_px - half_x
    scores = np.interp(columns, np.arange(band.shape[1]), band.max(axis=0), left=UNSEEN, right=UNSEEN)
    return CorrelationProfile(inverse_z_per_m=inverse_z_per_m, scores=scores)


def register_eye(
    eye: ReducedEye,
    role: Role,
    wide_view: NDArray[np.float32],
    target: NDArray[np.float64],
    inverse_z_per_m: float,
    *,
    calibration: Calibration,
    f_px: float,
) -> EyeMatch | None:
    """Refine the target's inverse depth from a first one by registration; return None where nothing fits.

    `wide_view`: the wide image about the target, equalised, survey px, at least `view_half_px` to each side.
    `target`: (2,) tangents at the time of the look.
    """
    half_baseline_m = side_of(role) * 0.5 * calibration.baseline_m
    u_px = f_px * (float(target[0]) + half_baseline_m * inverse_z_per_m)
    position_px = (u_px - eye.u0_px, float(target[1]) * f_px - eye.v0_px)
    best: EyeMatch | None = None
    for window in WINDOWS:
        placed = _registered(eye, wide_view, position_px, window)
        if placed is None:
            continue
        sigma_px = math.hypot(placed.sigma_px[0], PLACED_SIGMA_PX, SHARED_SIGMA_PX)
        slope_rad = calibration.eye(role).angle_sigma_rad(1.0 / max(inverse_z_per_m, 1e-3))[0]
        match = EyeMatch(
            role=role,
            inverse_z_per_m=inverse_z_per_m + float(placed.position_px[0]) / (f_px * half_baseline_m),
            sigma_per_m=math.hypot(sigma_px / f_px, slope_rad) / abs(half_baseline_m),
            score=placed.score,
            row_px=float(placed.position_px[1]),
        )
        if best is None or match.sigma_per_m < 0.5 * best.sigma_per_m:
            best = match
        if math.isfinite(best.sigma_per_m):
            break
    return best


def view_half_px() -> tuple[int, int]:
    """Return the half sides of the wide view that a registration needs, survey px."""
    half = max(window.half_px for window in WINDOWS) + MARGIN_PX
    return half, half


def _registered(
    eye: ReducedEye, wide_view: NDArray[np.float32], position_px: tuple[float, float], window: MatchWindow
) -> SubpixelPosition | None:
    """Register the middle of the wide view at a place of one fovea; return None outside its field."""
    half = window.half_px + MARGIN_PX
    height, width = eye.image.shape
    x, y = position_px
    if not (window.half_px <= x <= width - 1 - window.half_px and 0.0 <= y <= height - 1):
        return None
    column, row = round(x), round(y)
    columns = np.clip(np.arange(column - half, column + half + 1), 0, width - 1)
    rows = np.clip(np.arange(row - half, row + half + 1), 0, height - 1)
    middle_y, middle_x = ((side - 1) // 2 for side in wide_view.shape)
    part = wide_view[middle_y - half : middle_y + half + 1, middle_x - half : middle_x + half + 1]
    away = np.array([x - column, y - row])
    placed = match_in_rows(
        InterpolatedPicture.of(np.ascontiguousarray(part)),
        InterpolatedPicture.of(np.ascontiguousarray(eye.image[np.ix_(rows, columns)])),
        WindowPlacement(x_px=float(away[0]), y_px=float(away[1])),
        window=window,
        expected_px=away,
    )
    return replace(placed, position_px=placed.position_px - away)
