"""Both foveae reduced by the zoom (about 9 times) to survey scale, for comparison with the wide view."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Role, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import crossing_z_m, plane_from_raw, to_uint8
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.matching.wide_patch import ENLARGED, WidePatch, evened

REDUCTION = 4
"""Integer part of the zoom, averaged before the warp, sensor px."""
BLUR_SIGMA_PX = 1.0
"""Blur of the reduced foveae, which are sharper than the enlarged wide image, survey px."""
LEAST_SEEN = 0.97
"""Least share of a window that must lie in the fovea's frame."""
ROLLED_AWAY_PX = 12
"""Field lost at the patch's height to the image's rotation (up to 10 degrees), survey px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedEye:
    """One fovea at survey scale: a window of its virtual plane from (u0, v0) px on.

    `image`: (h, w) float32, odd sides. `seen`: (h, w) float32, 0 beyond the frame.
    """

    image: NDArray[np.float32]
    seen: NDArray[np.float32]
    u0_px: float
    v0_px: float

    @property
    def centre_px(self) -> NDArray[np.float64]:
        """(2,) plane px of the fovea's image centre."""
        height, width = self.image.shape
        return np.array([self.u0_px + (width - 1) / 2, self.v0_px + (height - 1) / 2])

    def hidden(self, shape: tuple[int, ...], rows: slice = slice(None)) -> NDArray[np.bool_]:
        """Return which windows of an odd (h, w) reach past the frame, (H - h + 1, W - w + 1) bool.

        `rows`: the rows to return.
        """
        height, width = shape
        cover = cv2.blur(self.seen, (width, height), borderType=cv2.BORDER_REPLICATE)
        half_y, half_x = (height - 1) // 2, (width - 1) // 2
        inside = cover[half_y : cover.shape[0] - half_y, half_x : cover.shape[1] - half_x]
        return np.asarray(inside[rows] < LEAST_SEEN)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedLook:
    """Both foveae of one look at survey scale, with its focal length."""

    left: ReducedEye
    right: ReducedEye
    f_px: float


def epipolar_looks(calibration: Calibration, template: WidePatch, nearest_m: float) -> Iterator[float]:
    """Yield 1/Z, 1/m, of the looks that together cover every depth from infinity to `nearest_m`.

    A look covers its field less half the patch; the first is parallel (Sec. 3.4).
    """
    half_field = (calibration.fovea_width - 1) / 2 / calibration.fovea_f_px
    half_patch = (template.patch.shape[1] - 1) / 2 + ROLLED_AWAY_PX
    cover = half_field - half_patch / template.f_px
    nearest = calibration.baseline_m / 2.0 / nearest_m
    shift = 0.0
    while shift - cover < nearest:
        yield 2.0 * shift / calibration.baseline_m
        shift += 2.0 * cover


def reduce_look(sighting: Sighting, calibration: Calibration, *, f_px: float) -> ReducedLook:
    """Reduce both foveae to survey scale, equalised."""
    return even_look(shrink_look(sighting, calibration, f_px=f_px))


def even_look(look: ReducedLook) -> ReducedLook:
    """Return a look at survey scale with brightness and contrast equalised."""
    left, right = (replace(eye, image=evened(eye.image)) for eye in (look.left, look.right))
    return ReducedLook(left=left, right=right, f_px=look.f_px)


def reduce_eye(
    sighting: Sighting, calibration: Calibration, role: Role, *, f_px: float, depth_m: float
) -> ReducedEye:
    """Reduce one fovea to survey scale, equalised; parallax of pupil and pivot is corrected at `depth_m`."""
    shown = shrink_eye(sighting, calibration, role, f_px=f_px, depth_m=depth_m)
    return replace(shown, image=evened(shown.image))


def shrink_eye(
    sighting: Sighting, calibration: Calibration, role: Role, *, f_px: float, depth_m: float
) -> ReducedEye:
    """Like `reduce_eye`, not equalised."""
    frame = sighting.left if role is Role.LEFT else sighting.right
    own = calibration.binned(frame.binning)
    plane = plane_from_raw(own, role, sighting.volts, depth_m=depth_m)
    return _shrunk(
        gray(to_uint8(frame)),
        plane,
        zoom=f_px / own.fovea_f_px,
        reduction=REDUCTION // frame.binning,
        blur_px=blur_sigma_px(sighting.wide.binning),
    )


def shrink_look(sighting: Sighting, calibration: Calibration, *, f_px: float) -> ReducedLook:
    """Like `reduce_look`, not equalised."""
    z_m = crossing_z_m(calibration, sighting.volts)
    left, right = (shrink_eye(sighting, calibration, role, f_px=f_px, depth_m=z_m) for role in EYES)
    return ReducedLook(left=left, right=right, f_px=f_px)


def blur_sigma_px(wide: Binning) -> float:
    """Return the blur that makes a reduced fovea as soft as the enlarged wide image, survey px.

    A pixel of a binned wide image blurs too: a square of n wide px has the variance n² / 12.
    """
    return math.sqrt(BLUR_SIGMA_PX**2 + (wide**2 - 1) * ENLARGED**2 / 12.0)


def _shrunk(
    image: NDArray[np.uint8], plane: NDArray[np.float64], *, zoom: float, reduction: int, blur_px: float
) -> ReducedEye:
    height, width = image.shape
    small = cv2.resize(image, (width // reduction, height // reduction), interpolation=cv2.INTER_AREA).astype(
        np.float32
    )
    size = (round(width * zoom) | 1, round(height * zoom) | 1)
    middle = plane @ np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
    u0, v0 = (zoom * middle[k] / middle[2] - (size[k] - 1) / 2 for k in (0, 1))
    offset = (reduction - 1) / 2
    raw_from_small = np.array([[reduction, 0.0, offset], [0.0, reduction, offset], [0.0, 0.0, 1.0]])
    window = np.array([[zoom, 0.0, -u0], [0.0, zoom, -v0], [0.0, 0.0, 1.0]]) @ plane @ raw_from_small
    view = cv2.warpPerspective(small, window, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    seen = cv2.warpPerspective(np.ones_like(small), window, size, flags=cv2.INTER_LINEAR)
    blurred = np.asarray(cv2.GaussianBlur(view, (0, 0), blur_px), dtype=np.float32)
    return ReducedEye(
        image=blurred, seen=np.asarray(seen, dtype=np.float32), u0_px=float(u0), v0_px=float(v0)
    )
