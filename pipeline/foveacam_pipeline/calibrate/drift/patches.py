"""Selection of the textured, static patches of the wide view that a drift check looks at.

Candidates are taken in each part of the field of regard, and where the depth is known from markers or a tape;
only those of known depth determine the angle between the eyes.
"""

import math
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, InvalidInput, Role
from foveacam_pipeline.calibrate.drift.values import DriftSettings
from foveacam_pipeline.calibrate.sweep.marker_target import locate_target
from foveacam_pipeline.calibrate.sweep.markers import find_markers
from foveacam_pipeline.geometry.binning import enlarge, picture_px
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.matching.contrast import even
from foveacam_pipeline.verge.matching.texture import noise_level
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, cut_template

SHADING_PX = 6.0
CONTRAST_PX = 4.0
MIN_CONTRAST = 4.0
"""Minimum contrast in grey levels; all three values as for patches of the survey, at half its scale."""
PATCHES_PER_PART = 3
"""Number of candidates for each part of the field, in case the first is not found."""
PATCH_SPACING = 1.5
"""Minimum spacing of the candidates, patch sides."""
MOTION_LEVELS = 8.0
"""Minimum change between two images of a moving pixel, averaged over 5 x 5 px, grey levels."""
REACH_STEP = 24
"""Spacing of the grid on which the reach of the eyes is computed, wide px."""
MIN_ENERGY = 0.004
"""Minimum texture energy of a candidate; the normalised image has variance 1 where there is texture."""
Box: TypeAlias = tuple[float, float, float, float]
"""x min, y min, x max, y max, wide px."""
MIDDLE_PX = 60.0
"""The object whose distance the operator gave lies within this radius of the middle, wide px."""
MIDDLE_PART = -1
MARKER_PARTS = {Role.WIDE: -2, Role.LEFT: -3, Role.RIGHT: -4}
LENS_REL_SIGMA = 2e-4
"""Relative standard error of the wide camera's focal length, and so of the distance of a known target."""
FOUND = (80, 220, 100)
WANTED = (230, 200, 60)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftPatch:
    """A candidate for one look: its wide patch, and the number of the part of the field it belongs to."""

    template: WidePatch
    part: int
    known_inverse: float | None = None
    """1 / Z, 1/m, where the depth is known from markers or a tape; else None."""
    known_sigma: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DistinctnessMap:
    """The wide view, `gray`, (h, w) uint8 and binned or not, and its texture energy at the sensor's size.

    `energy`: (height, width) float32, 0 where it is unusable.
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
        """Rate the texture of the second of two wide images; moving or unreachable pixels are unusable."""
        binning = calibration.wide.binning_of(grays[1].shape)
        size = (calibration.wide.width, calibration.wide.height)
        energy = np.asarray(cv2.resize(_texture(grays[1], settings, binning), size), dtype=np.float32)
        moving = _moving(*grays, reach_px=settings.template_half_px, binning=binning)
        energy[cv2.resize(moving.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0] = 0.0
        energy[~_reached(calibration, settings)] = 0.0
        return cls(gray=grays[1], energy=energy)

    def best_pixels(self, box: Box, settings: DriftSettings) -> list[NDArray[np.float64]]:
        """Return the most textured pixels of a box, (2,) px each, best first and spaced apart."""
        guard = settings.template_half_px + 2
        low = [max(guard, round(box[k])) for k in (0, 1)]
        high = [min(side - guard, round(box[k + 2])) for k, side in enumerate(self.energy.shape[::-1])]
        if high[0] <= low[0] or high[1] <= low[1]:
            return []
        part = self.energy[low[1] : high[1], low[0] : high[0]].copy()
        found = []
        reach = round(PATCH_SPACING * 2 * settings.template_half_px)
        for _ in range(PATCHES_PER_PART):
            y, x = divmod(int(np.argmax(part)), part.shape[1])
            if part[y, x] < MIN_ENERGY:
                break
            found.append(np.array([low[0] + x, low[1] + y], dtype=np.float64))
            part[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = 0.0
        return found

    def cut_patch(self, wide: Intrinsics, pixel: NDArray[np.float64], settings: DriftSettings) -> WidePatch:
        """Return the patch about a pixel, (2,) px of the sensor."""
        half = settings.template_half_px
        target = np.tan(wide.angles_rad(pixel[None])[0])
        noise = noise_level(self.gray, at_px=picture_px(pixel, wide.binning_of(self.gray.shape)))
        return cut_template(self.gray, wide, target, half_px=(half, half), noise=noise)


def select_patches(
    field: DistinctnessMap, calibration: Calibration, settings: DriftSettings
) -> list[DriftPatch]:
    """Return the best candidates of each part of the field of regard, the best of every part first."""
    wide = calibration.wide
    chosen = [
        [
            DriftPatch(template=field.cut_patch(wide, at, settings), part=part)
            for at in field.best_pixels(box, settings)
        ]
        for part, box in enumerate(_parts_px(calibration, settings))
    ]
    return [part[k] for k in range(PATCHES_PER_PART) for part in chosen if k < len(part)]


def _texture(gray: NDArray[np.uint8], settings: DriftSettings, binning: Binning) -> NDArray[np.float32]:
    """Return the (h, w) float32 texture energy along the worst direction at each pixel.

    It is the smaller eigenvalue of the structure tensor of the normalised picture, per sensor px.
    """
    image = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), 1.0 / binning)
    evened = even(
        np.asarray(image, dtype=np.float32),
        shading_px=SHADING_PX / binning,
        contrast_px=CONTRAST_PX / binning,
        least=MIN_CONTRAST,
    )
    across = cv2.Scharr(evened, cv2.CV_32F, 1, 0, scale=1 / 32 / binning)
    down = cv2.Scharr(evened, cv2.CV_32F, 0, 1, scale=1 / 32 / binning)
    sigma = settings.template_half_px / 2.0 / binning
    xx, yy, xy = (
        cv2.GaussianBlur(cv2.multiply(a, b), (0, 0), sigma)
        for a, b in ((across, across), (down, down), (across, down))
    )
    return np.asarray((xx + yy) / 2.0 - np.sqrt((xx - yy) ** 2 / 4.0 + xy**2), dtype=np.float32)


def _moving(
    first: NDArray[np.uint8], second: NDArray[np.uint8], *, reach_px: int, binning: Binning
) -> NDArray[np.bool_]:
    """Return the (h, w) bool mask of pixels within reach, sensor px, of a change between two pictures."""
    averaged = (5, 5) if binning == 1 else (3, 3)
    change = cv2.absdiff(cv2.blur(first, averaged), cv2.blur(second, averaged))
    moved = (change > MOTION_LEVELS).astype(np.uint8)
    side = 2 * (reach_px // binning) + 1
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
    """Return the (h, w) bool mask of the wide image that both eyes can look at with a margin."""
    wide = calibration.wide
    xs, ys = np.arange(0, wide.width, REACH_STEP), np.arange(0, wide.height, REACH_STEP)
    angles = wide.angles_rad([(x, y) for y in ys.tolist() for x in xs.tolist()])
    size = np.linalg.norm(angles, axis=1, keepdims=True)
    farther = angles * (1.0 + settings.margin_rad / np.maximum(size, 1e-6))
    inside = np.logical_and.reduce([calibration.eye(role).mirror.inside(farther) for role in EYES])
    coarse = inside.reshape(len(ys), len(xs)).astype(np.uint8)
    size_px = (wide.width, wide.height)
    return np.asarray(cv2.resize(coarse, size_px, interpolation=cv2.INTER_NEAREST) > 0)


def patches_of_known_depth(
    field: DistinctnessMap, calibration: Calibration, settings: DriftSettings
) -> list[DriftPatch]:
    """Return the patches whose distance is known: the markers, and the middle at the operator's distance."""
    return [
        *_marker_patches(field, calibration, settings),
        *_measured_distance_patches(field, calibration, settings),
    ]


def _marker_patches(
    field: DistinctnessMap, calibration: Calibration, settings: DriftSettings
) -> list[DriftPatch]:
    """Return the markers of the target, if it is in view and fits its printed layout."""
    layout = settings.layout
    if layout is None:
        return []
    picture = enlarge(field.gray, binning=calibration.wide.binning_of(field.gray.shape))
    views = find_markers(picture, side_m=layout.side_m, only=layout.ids)
    try:
        pose = locate_target(views, layout, calibration.wide)
    except InvalidInput:
        return []  # markers are missing, or others of the same numbers are in view
    rel_sigma = math.hypot(pose.distance_sigma_m / pose.distance_m, LENS_REL_SIGMA)
    candidates = []
    for role in (role for role in Role if layout.id_of(role) in views):
        x_m, y_m, z_m = pose.marker_rig_m(role).tolist()
        pixel = calibration.wide.pixels([[math.atan(x_m / z_m), math.atan(y_m / z_m)]])[0]
        candidates.append(
            DriftPatch(
                template=field.cut_patch(calibration.wide, pixel, settings),
                part=MARKER_PARTS[role],
                known_inverse=1.0 / z_m,
                known_sigma=rel_sigma / z_m,
            )
        )
    return candidates


def _measured_distance_patches(
    field: DistinctnessMap, calibration: Calibration, settings: DriftSettings
) -> list[DriftPatch]:
    """Return the most textured patches in the middle of the view, if the operator gave its distance."""
    if settings.distance_m is None:
        return []
    wide = calibration.wide
    middle = np.array([(wide.width - 1) / 2.0, (wide.height - 1) / 2.0])
    (left, top), (right, bottom) = (middle - MIDDLE_PX).tolist(), (middle + MIDDLE_PX).tolist()
    candidates = []
    for pixel in field.best_pixels((left, top, right, bottom), settings):
        template = field.cut_patch(wide, pixel, settings)
        inverse = math.hypot(1.0, *template.target.tolist()) / settings.distance_m
        candidates.append(
            DriftPatch(
                template=template,
                part=MIDDLE_PART,
                known_inverse=inverse,
                known_sigma=inverse * settings.distance_rel_sigma,
            )
        )
    return candidates


def draw_patches(
    gray: NDArray[np.uint8], calibration: Calibration, queue: list[DriftPatch], done: set[int]
) -> NDArray[np.uint8]:
    """Return the wide view with a frame around the first candidate of each part, (h, w, 3) uint8 RGB."""
    picture = enlarge(gray, binning=calibration.wide.binning_of(gray.shape))
    view = cv2.cvtColor(picture, cv2.COLOR_GRAY2RGB)
    drawn: set[int] = set()
    for candidate in queue:
        if candidate.part in drawn:
            continue
        drawn.add(candidate.part)
        x, y = calibration.wide.pixels(np.arctan(candidate.template.target)[None])[0].tolist()
        half_x, half_y = candidate.template.half_px
        corners = (round(x - half_x), round(y - half_y)), (round(x + half_x), round(y + half_y))
        cv2.rectangle(view, *corners, FOUND if candidate.part in done else WANTED, 2, cv2.LINE_AA)
    return np.asarray(view, dtype=np.uint8)
