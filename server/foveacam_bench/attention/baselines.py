"""Policies to compare with, in all of which both eyes verge: raster, chance, salience, uncertainty alone."""

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.attention.field import FieldState, Floats
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.losses import DepthRange, map_loss
from foveacam_pipeline.attention.policy import Look
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import EYES, Gazes, reach_span
from foveacam_pipeline.wide_depth.wide_matches import NEAREST_M

SPACING = 0.85
"""Distance of neighbouring directions of the raster as a share of a fovea's field."""
RESIDUAL_PX = 64
"""Width at which the spectral residual is computed (Hou and Zhang, 2007)."""
RETURN_FACTOR = 0.2
"""What a place is worth that was looked at, as a share: inhibition of return."""


def verged_look(candidates: Candidates, state: FieldState, direction: Floats, *, reason: str) -> Look | None:
    """Return the look of both eyes at a direction, (2,) tangents, at the depth expected there.

    None where they do not reach it.
    """
    span = reach_span(candidates.calibration, direction, nearest=1.0 / NEAREST_M)
    if span is None:
        return None
    aside = np.abs(candidates.grid.tangents - direction)
    near = (aside <= candidates.half_view).all(axis=1)
    expected = float(np.median(state.inverse_z_per_m[near])) if near.any() else 1.0 / NEAREST_M
    inverse_z = float(np.clip(expected, *span))
    gazes = candidates.verged(direction[None], np.array([inverse_z]))
    gazes = Gazes(left=gazes.left[0], right=gazes.right[0])
    cells = candidates.shown_under(gazes, state.inverse_z_per_m)
    return Look(
        gazes=gazes,
        meeting_m=1.0 / max(inverse_z, 1e-6),
        expected_per_m=dict.fromkeys(EYES, inverse_z),
        cells=cells,
        promised=0.0,
        worth=1.0,
        reason=reason,
    )


@dataclass(slots=True)
class Raster:
    """The directions of the field, row by row, again and again."""

    candidates: Candidates
    _next: int = 0

    def choose(self, state: FieldState) -> Look | None:
        """Return the look at the next direction that both eyes reach."""
        directions = field_directions(self.candidates.calibration)
        for _ in range(len(directions)):
            direction = directions[self._next % len(directions)]
            self._next += 1
            look = verged_look(self.candidates, state, direction, reason="next in the raster")
            if look is not None:
                return look
        return None


@dataclass(slots=True)
class RandomLooks:
    """Directions drawn by chance."""

    candidates: Candidates
    rng: np.random.Generator

    def choose(self, state: FieldState) -> Look | None:
        """Return a look that both eyes reach; None where none of many tried is."""
        for _ in range(200):
            direction = self.rng.choice(self.candidates.directions)
            look = verged_look(self.candidates, state, direction, reason="by chance")
            if look is not None:
                return look
        return None


@dataclass(slots=True)
class BySalience:
    """The most salient place of the wide picture, less what was looked at."""

    candidates: Candidates
    salience: Floats
    """(n,) of each cell."""

    def choose(self, state: FieldState) -> Look | None:
        """Return the look at the most salient place that both eyes reach."""
        left = np.where(np.isfinite(state.looked_s), RETURN_FACTOR ** np.minimum(1 + state.tries, 8), 1.0)
        return _best_of(self.candidates, state, left * self.salience, "most salient")


@dataclass(slots=True)
class ByUncertainty:
    """The place whose depth is known worst, whatever may be measured there."""

    candidates: Candidates
    depths: DepthRange = field(default_factory=DepthRange)

    def choose(self, state: FieldState) -> Look | None:
        """Return the look at the place of the largest loss that both eyes reach."""
        since_s = state.now_s - np.maximum(state.looked_s, -1e6)
        tie = 1e-9 * since_s / max(float(since_s.max()), 1e-9)
        return _best_of(self.candidates, state, map_loss(state, self.depths) + tie, "known worst")


def spectral_residual(gray: NDArray[np.uint8], shape: tuple[int, int]) -> Floats:
    """Return (rows * columns,) the salience of a grey picture by its spectral residual, 0 to 1.

    Hou and Zhang, "Saliency Detection: A Spectral Residual Approach", CVPR 2007, equations 3 to 6.
    """
    height = max(8, round(RESIDUAL_PX * gray.shape[0] / gray.shape[1]))
    small = cv2.resize(gray, (RESIDUAL_PX, height), interpolation=cv2.INTER_AREA).astype(np.float64)
    spectrum = np.fft.fft2(small)
    amplitude = np.log(np.abs(spectrum) + 1e-9)
    residual = amplitude - cv2.blur(amplitude, (3, 3))
    restored = np.abs(np.fft.ifft2(np.exp(residual + 1j * np.angle(spectrum)))) ** 2
    smooth = cv2.GaussianBlur(restored, (0, 0), 2.5)
    rows, columns = shape
    cells = cv2.resize(smooth, (columns, rows), interpolation=cv2.INTER_AREA).ravel()
    return np.asarray(cells / max(float(cells.max()), 1e-12), dtype=np.float64)


def _best_of(candidates: Candidates, state: FieldState, worth: Floats, reason: str) -> Look | None:
    """Return the look at the direction with the largest sum of a worth, (n,), that both eyes reach."""
    directions, near = candidates.directions, candidates.near_directions
    for index in np.argsort(-(near @ worth.astype(np.float32))):
        look = verged_look(candidates, state, directions[index], reason=reason)
        if look is not None:
            return look
    return None


def field_directions(calibration: Calibration) -> NDArray[np.float64]:
    """Return (n, 2) tangents that cover what both eyes reach, row by row, every second row backwards."""
    left, right, top, bottom = np.tan(calibration.wide.field_rad)
    step_x, step_y = (
        SPACING * size / calibration.fovea_f_px
        for size in (calibration.fovea_width, calibration.fovea_height)
    )
    columns = _spread(left + step_x / 2, right - step_x / 2, step_x)
    rows = _spread(top + step_y / 2, bottom - step_y / 2, step_y)
    found = []
    for number, y in enumerate(rows):
        for x in columns if number % 2 == 0 else columns[::-1]:
            if reach_span(calibration, np.array([x, y]), nearest=1.0 / NEAREST_M) is not None:
                found.append((float(x), float(y)))
    return np.array(found).reshape(-1, 2)


def _spread(low: float, high: float, step: float) -> NDArray[np.float64]:
    """Return evenly spaced positions from `low` to `high`, at most `step` apart."""
    count = max(1, math.ceil((high - low) / step) + 1)
    return np.linspace(low, high, count) if count > 1 else np.array([(low + high) / 2])
