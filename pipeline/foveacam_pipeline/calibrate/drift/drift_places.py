"""Where to look: textured places that stand still, one in each part of the field of regard."""

from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.drift.drift_values import DriftSettings
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.contrast import even
from foveacam_pipeline.verge.texture import noise_level
from foveacam_pipeline.verge.wide_patch import WidePatch, cut_template

SHADING_PX = 6.0
CONTRAST_PX = 4.0
LEAST_CONTRAST = 4.0
"""As for patches of the survey, at half its scale; grey levels."""
ALTERNATIVES = 3
"""So many places are kept for each part of the field, should the first not be found."""
APART = 1.5
"""They lie this many patch sides apart."""
MOVED_LEVELS = 8.0
"""What changes by more between two pictures, averaged over 5 x 5 px, moves; grey levels."""
REACH_STEP = 24
"""Where the eyes reach is worked out on every so many wide px."""
LEAST_ENERGY = 0.004
"""Texture below this says too little; the evened-out image has variance 1 where there is any."""


Box: TypeAlias = tuple[float, float, float, float]
"""x min, y min, x max, y max, wide px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftPatch:
    """A place to look at: its patch, and the part of the field it stands for."""

    template: WidePatch
    part: int
    known_inverse: float | None = None
    """1 / Z, 1/m, where the depth is known otherwise than by the eyes."""
    known_sigma: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistinctnessMap:
    """The wide view with how well each place of it can be told from its neighbours, 0 where it is no use.

    `gray`: (h, w) uint8. `energy`: (h, w) float32.
    """

    gray: NDArray[np.uint8]
    energy: NDArray[np.float32]

    @classmethod
    def of(
        cls,
        grays: tuple[NDArray[np.uint8], NDArray[np.uint8]],
        calibration: Calibration,
        settings: DriftSettings,
    ) -> "DistinctnessMap":
        """Judge the second of two wide pictures; what moved between them or is out of reach is no use."""
        energy = _texture(grays[1], settings)
        energy[_moving(*grays, reach_px=settings.template_half_px)] = 0.0
        energy[~_reached(calibration, settings)] = 0.0
        return cls(gray=grays[1], energy=energy)

    def best(self, box: Box, settings: DriftSettings) -> list[NDArray[np.float64]]:
        """Return the most textured pixels of a box, (2,) px each, best first and not near each other."""
        guard = settings.template_half_px + 2
        low = [max(guard, round(box[k])) for k in (0, 1)]
        high = [min(side - guard, round(box[k + 2])) for k, side in enumerate(self.gray.shape[::-1])]
        if high[0] <= low[0] or high[1] <= low[1]:
            return []
        part = self.energy[low[1] : high[1], low[0] : high[0]].copy()
        found = []
        reach = round(APART * 2 * settings.template_half_px)
        for _ in range(ALTERNATIVES):
            y, x = divmod(int(np.argmax(part)), part.shape[1])
            if part[y, x] < LEAST_ENERGY:
                break
            found.append(np.array([low[0] + x, low[1] + y], dtype=np.float64))
            part[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = 0.0
        return found

    def patch(self, wide: Intrinsics, pixel: NDArray[np.float64], settings: DriftSettings) -> WidePatch:
        """Cut the patch about a pixel, (2,) px."""
        half = settings.template_half_px
        target = np.tan(wide.angles_rad(pixel[None])[0])
        noise = noise_level(self.gray, at_px=pixel)
        return cut_template(self.gray, wide, target, half_px=(half, half), noise=noise)


def spots(field: DistinctnessMap, calibration: Calibration, settings: DriftSettings) -> list[DriftPatch]:
    """Return the best places of each part of the field of regard, the best of every part first."""
    wide = calibration.wide
    chosen = [
        [DriftPatch(template=field.patch(wide, at, settings), part=part) for at in field.best(box, settings)]
        for part, box in enumerate(_parts_px(calibration, settings))
    ]
    return [part[k] for k in range(ALTERNATIVES) for part in chosen if k < len(part)]


def _texture(gray: NDArray[np.uint8], settings: DriftSettings) -> NDArray[np.float32]:
    """Return how well each place of the picture can be told from its neighbours, along its worst direction.

    The smaller eigenvalue of the gradients' moments in the evened-out picture, (h, w) float32.
    """
    image = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), 1.0)
    evened = even(
        np.asarray(image, dtype=np.float32),
        shading_px=SHADING_PX,
        contrast_px=CONTRAST_PX,
        least=LEAST_CONTRAST,
    )
    across = cv2.Scharr(evened, cv2.CV_32F, 1, 0, scale=1 / 32)
    down = cv2.Scharr(evened, cv2.CV_32F, 0, 1, scale=1 / 32)
    sigma = settings.template_half_px / 2.0
    xx, yy, xy = (
        cv2.GaussianBlur(cv2.multiply(a, b), (0, 0), sigma)
        for a, b in ((across, across), (down, down), (across, down))
    )
    return np.asarray((xx + yy) / 2.0 - np.sqrt((xx - yy) ** 2 / 4.0 + xy**2), dtype=np.float32)


def _moving(first: NDArray[np.uint8], second: NDArray[np.uint8], *, reach_px: int) -> NDArray[np.bool_]:
    """Return where something changed between two pictures, or near there, (h, w) bool."""
    change = cv2.absdiff(cv2.blur(first, (5, 5)), cv2.blur(second, (5, 5)))
    moved = (change > MOVED_LEVELS).astype(np.uint8)
    side = 2 * reach_px + 1
    return np.asarray(cv2.dilate(moved, np.ones((side, side), dtype=np.uint8)) > 0)


def _parts_px(calibration: Calibration, settings: DriftSettings) -> list[Box]:
    """Return the parts of the field of regard as boxes of wide px."""
    hulls = [calibration.eye(role).mirror.hull_rad for role in EYES]
    low = np.max([hull.min(axis=0) for hull in hulls], axis=0)
    high = np.min([hull.max(axis=0) for hull in hulls], axis=0)
    xs = np.linspace(low[0], high[0], settings.columns + 1)
    ys = np.linspace(low[1], high[1], settings.rows + 1)
    corners = calibration.wide.pixels([(x, y) for y in ys for x in xs]).reshape(len(ys), len(xs), 2)
    return [
        (*corners[row, column].tolist(), *corners[row + 1, column + 1].tolist())
        for row in range(settings.rows)
        for column in range(settings.columns)
    ]


def _reached(calibration: Calibration, settings: DriftSettings) -> NDArray[np.bool_]:
    """Return where both eyes can look with a margin, (h, w) bool of the wide image."""
    wide = calibration.wide
    xs, ys = np.arange(0, wide.width, REACH_STEP), np.arange(0, wide.height, REACH_STEP)
    angles = wide.angles_rad([(x, y) for y in ys.tolist() for x in xs.tolist()])
    size = np.linalg.norm(angles, axis=1, keepdims=True)
    farther = angles * (1.0 + settings.margin_rad / np.maximum(size, 1e-6))
    inside = np.logical_and.reduce([calibration.eye(role).mirror.inside(farther) for role in EYES])
    coarse = inside.reshape(len(ys), len(xs)).astype(np.uint8)
    size_px = (wide.width, wide.height)
    return np.asarray(cv2.resize(coarse, size_px, interpolation=cv2.INTER_NEAREST) > 0)
