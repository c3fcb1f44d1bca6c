"""Parts of the wide image, undistorted and enlarged: a target's patch, the view where the foveae look.

The patch has slow shading removed. The view has the foveae's scale, and shows what the wide camera alone
resolves.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, StereoVolts
from foveacam_pipeline.matching.correlation import peak, score_map
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import gazes_under
from foveacam_pipeline.verge.matching.contrast import even
from foveacam_pipeline.verge.matching.texture import shift_sigma

ENLARGED = 2.0
"""Survey px per wide px of the sensor: enough for a smooth peak, few enough to be fast."""
SHADING_SIGMA_PX = 12.0
"""Standard deviation of the blur that is subtracted to remove shading, survey px."""
CONTRAST_SIGMA_PX = 6.0
"""Standard deviation of the window in which contrast is equalised, survey px."""
LEAST_CONTRAST = 4.0
"""Contrast below this may be the wide camera's noise, grey levels."""
MARGIN_PX = 24
BELL_SHARE = 0.6
"""Standard deviation of the weights, as a share of the patch's half side (they enter squared)."""
TRACK_REACH_PX = 8
"""Search radius of a patch in a frame of the same moment, survey px."""
TRACK_REACH_MAX_PX = 160
FASTEST_RAD_PER_S = 0.2
"""Angular speed of the fastest target that is tracked: 2 m/s at 10 m."""
TURN_RAD_PER_S = 0.1
"""Largest error of a moving target's predicted speed."""
TRACK_SCORE = 0.5
MOVED_SCORE = 0.75
"""Least correlation of a patch found elsewhere: walkers reach 0.8 from frame to frame, look-alikes beside a
hidden target up to 0.7."""
FIT_REACH_PX = 4
TRACK_LEAD = 0.1
"""Least lead in correlation of another place over the old one."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WidePatch:
    """A patch about a target, on the virtual pinhole at the rig's origin whose focal length is `f_px`.

    `patch`: (h, w) float32, odd sides, equalised; its middle is the target. `target`: (2,) tangents.
    `sigma_px`: error of its place in another picture due to its own noise, along x, wide px.
    """

    patch: NDArray[np.float32]
    target: NDArray[np.float64]
    f_px: float
    sigma_px: float

    @property
    def half_px(self) -> tuple[float, float]:
        """Half sides, wide px."""
        height, width = self.patch.shape
        return (width - 1) / 2 / ENLARGED, (height - 1) / 2 / ENLARGED


def survey_f_px(wide: Intrinsics) -> float:
    """Return the focal length at which the wide image and the foveae are compared, px."""
    return ENLARGED * wide.fx_px


def cut_template(
    gray: NDArray[np.uint8],
    wide: Intrinsics,
    target: NDArray[np.float64],
    *,
    half_px: tuple[int, int],
    noise: float,
) -> WidePatch:
    """Cut the patch about `target`: (2,) tangents, half sides of (x, y) wide px; `noise` in grey levels."""
    f_px, binning = survey_f_px(wide), wide.binning_of(gray.shape)
    half = (round(ENLARGED * half_px[0]), round(ENLARGED * half_px[1]))
    view = wide_window(gray, wide, target, f_px=f_px, half=(half[0] + MARGIN_PX, half[1] + MARGIN_PX))
    inner = (slice(MARGIN_PX, -MARGIN_PX), slice(MARGIN_PX, -MARGIN_PX))
    return WidePatch(
        patch=np.ascontiguousarray(evened(view)[inner]),
        target=target,
        f_px=f_px,
        sigma_px=binning * shift_sigma(view[inner], noise=noise, enlarged=binning * ENLARGED),
    )


def room_px(wide: Intrinsics, target: NDArray[np.float64]) -> int:
    """Return the distance of the target from the edge of the wide image, whole wide px; negative outside."""
    x, y = wide.pixels(np.arctan(target)[None])[0].tolist()
    return math.floor(min(float(x), float(y), wide.width - 1 - float(x), wide.height - 1 - float(y)))


def follow(
    template: WidePatch, gray: NDArray[np.uint8], wide: Intrinsics, *, elapsed_s: float
) -> NDArray[np.float64] | None:
    """Return the patch's direction in a later wide frame, (2,) tangents, or None when it is not found.

    It counts as moved only when it fits well elsewhere, and clearly better than at its old place.
    """
    if float(_fits(template, gray, wide, reach_px=1).max()) > 1.0 - TRACK_LEAD:
        return template.target  # no other place can lead by `TRACK_LEAD`
    fastest_px = FASTEST_RAD_PER_S * template.f_px * abs(elapsed_s)
    reach = round(min(TRACK_REACH_MAX_PX, TRACK_REACH_PX + fastest_px))
    scores = _fits(template, gray, wide, reach_px=reach)
    here = float(scores[reach - 1 : reach + 2, reach - 1 : reach + 2].max())
    x, y, best = peak(scores)
    if max(here, best) < TRACK_SCORE:
        return None
    if best < here + TRACK_LEAD:
        return template.target
    if best < MOVED_SCORE:
        return None
    return template.target + np.array([x - reach, y - reach]) / template.f_px


def follow_on(
    template: WidePatch,
    gray: NDArray[np.uint8],
    wide: Intrinsics,
    *,
    expected: NDArray[np.float64],
    unseen_s: float,
) -> NDArray[np.float64] | None:
    """Return the direction of a moving target's patch, (2,) tangents, or None when it is not found.

    `expected`: direction that its track predicts, (2,) tangents. `unseen_s`: time since it was last found;
    the search widens with it.
    """
    reach = round(min(TRACK_REACH_MAX_PX, TRACK_REACH_PX + TURN_RAD_PER_S * template.f_px * abs(unseen_s)))
    scores = _fits(replace(template, target=expected), gray, wide, reach_px=reach)
    x, y, best = peak(scores)
    if best < MOVED_SCORE:
        return None
    return np.asarray(expected + np.array([x - reach, y - reach]) / template.f_px, dtype=np.float64)


def fit_at(
    template: WidePatch, gray: NDArray[np.uint8], wide: Intrinsics, target: NDArray[np.float64]
) -> float:
    """Return the correlation of a patch with a wide image at a direction, (2,) tangents; -1 to 1."""
    return float(_fits(replace(template, target=target), gray, wide, reach_px=FIT_REACH_PX).max())


def _fits(
    template: WidePatch, gray: NDArray[np.uint8], wide: Intrinsics, *, reach_px: int
) -> NDArray[np.float32]:
    """Return correlations of the patch within `reach_px` survey px, (2 reach + 1, 2 reach + 1)."""
    height, width = template.patch.shape
    half = ((width - 1) // 2 + reach_px + MARGIN_PX, (height - 1) // 2 + reach_px + MARGIN_PX)
    view = evened(wide_window(gray, wide, template.target, f_px=template.f_px, half=half))
    inner = (slice(MARGIN_PX, -MARGIN_PX), slice(MARGIN_PX, -MARGIN_PX))
    return score_map(view[inner], template.patch, weights=bell(template.patch.shape))


def cut_view(
    gray: NDArray[np.uint8],
    wide: Intrinsics,
    target: NDArray[np.float64],
    *,
    f_px: float,
    half: tuple[int, int],
) -> NDArray[np.float32]:
    """Return the wide image about `target`, equalised, (2 half_y + 1, 2 half_x + 1) float32 survey px."""
    wider = (half[0] + MARGIN_PX, half[1] + MARGIN_PX)
    view = evened(wide_window(gray, wide, target, f_px=f_px, half=wider))
    return np.ascontiguousarray(view[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX])


def evened(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return an image at survey scale with brightness and contrast equalised."""
    return even(image, shading_px=SHADING_SIGMA_PX, contrast_px=CONTRAST_SIGMA_PX, least=LEAST_CONTRAST)


def leaning(patch: NDArray[np.float32], along: float, across: float) -> NDArray[np.float32]:
    """Return the patch as a sloped surface shows it: rows stretched by `along`, shifted by `across` a row."""
    height, width = patch.shape
    middle_x, middle_y = (width - 1) / 2, (height - 1) / 2
    matrix = np.array([[1.0 + along, across, -along * middle_x - across * middle_y], [0.0, 1.0, 0.0]])
    view = cv2.warpAffine(
        patch,
        matrix,
        (width, height),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REFLECT_101,
    )
    return np.asarray(view, dtype=np.float32)


@lru_cache(maxsize=32)
def bell(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return weights that fall off from the middle of a patch (h, w): its rim may show something else."""
    x, y = (np.exp(-0.5 * (np.linspace(-1.0, 1.0, side) / BELL_SHARE) ** 2) for side in shape[::-1])
    weights = np.outer(y, x).astype(np.float32)
    weights.flags.writeable = False
    return weights


def wide_window(
    gray: NDArray[np.uint8],
    wide: Intrinsics,
    target: NDArray[np.float64],
    *,
    f_px: float,
    half: tuple[int, int],
) -> NDArray[np.float32]:
    """Return the wide image on the virtual pinhole about `target`, (2 half_y + 1, 2 half_x + 1) float32.

    `gray` may be binned. Distortion is smooth: it is computed on a coarse mesh and interpolated.
    """
    knots = 9
    xs, ys = (np.linspace(-h, h, knots) for h in half)
    mesh = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2) / f_px + target
    pixels = wide.of_picture(gray.shape).pixels(np.arctan(mesh)).reshape(knots, knots, 2)
    size = (2 * half[0] + 1, 2 * half[1] + 1)
    rows, columns = np.linspace(0, knots - 1, size[1]), np.linspace(0, knots - 1, size[0])
    grid_x, grid_y = np.meshgrid(columns.astype(np.float32), rows.astype(np.float32))
    maps = cv2.remap(
        pixels.astype(np.float32), grid_x, grid_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT
    )
    view = cv2.remap(gray, maps[..., 0], maps[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(view, dtype=np.float32)


def wide_zoom(
    frame: Frame, calibration: Calibration, volts: StereoVolts, *, scale: float = 0.5
) -> NDArray[np.uint8]:
    """Return the wide image about the point where both gazes meet, (h, w[, 3]) uint8, odd sides.

    `scale`: relative to the foveae's. Where the gazes do not meet, the middle between them is shown.
    """
    meeting = calibration.meeting(volts)
    if meeting.in_front:
        target = meeting.point_m[:2] / meeting.point_m[2]
    else:
        gazes = gazes_under(calibration, volts)
        target = (gazes.left + gazes.right) / 2.0
    half = (round(scale * calibration.fovea_width / 2), round(scale * calibration.fovea_height / 2))
    view = wide_window(
        to_uint8(frame), calibration.wide, target, f_px=scale * calibration.fovea_f_px, half=half
    )
    return np.clip(np.rint(view), 0, 255).astype(np.uint8)
