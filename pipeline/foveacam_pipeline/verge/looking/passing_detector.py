"""Detection of movement near a target: people cross a line of sight for about a second.

In the wide view somebody who crosses an eye's line of sight appears beside the target, by half the baseline
over their depth. So a strip along the row is watched, long enough for somebody at 1.3 m.
"""

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Clock, Frame
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.matching.texture import noise_level

STRIP_PX = (160, 32)
"""Half sides of the strip, wide px: half a baseline of 0.12 m at 1.2 m."""
BLUR_SIGMA_PX = 2.0
LEAST_CHANGE = 6.0
"""Least change of brightness that counts, standard deviations of the wide camera's noise after the blur."""
MOVED_SHARE = 0.01
"""Least share of the strip's pixels that changes when something moves in it."""
LONGEST_S = 2.0
HIDDEN_LONGEST_S = 5.0
"""The same while the target is hidden: a walker covers a place for up to three seconds."""
STILL_S = 0.2
"""The view counts as still when nothing has moved for this long."""
POLL_NS = 50_000_000


class PassingDetector:
    """Detects movement in the strip of the wide view about a target."""

    def __init__(
        self,
        wide: Intrinsics,
        target: NDArray[np.float64],
        *,
        half_px: tuple[float, float] = STRIP_PX,
    ) -> None:
        """`target`: (2,) tangents from the rig's origin. `half_px`: half sides of the strip, wide px."""
        self._wide, self._target, self._half_px = wide, target, half_px

    def differ(self, one: Frame, other: Frame) -> bool:
        """Return whether something moved there between two wide frames; False if their binnings differ."""
        if one.binning != other.binning:
            return False
        images = [gray(to_uint8(frame)) for frame in (one, other)]
        at_px = self._wide.of_picture(images[0].shape).pixels(np.arctan(self._target)[None])[0]
        noise, sigma_px = noise_level(images[0], at_px=at_px), BLUR_SIGMA_PX / one.binning
        strips = (_strip(image, at_px, self._half_px, one.binning) for image in images)
        before, after = (cv2.GaussianBlur(strip, (0, 0), sigma_px) for strip in strips)
        blurred_noise = math.sqrt(2.0) * noise / (2.0 * math.sqrt(math.pi) * sigma_px)
        change = np.abs(after - before)
        return float(np.mean(change > LEAST_CHANGE * blurred_noise)) > MOVED_SHARE


def _strip(
    image: NDArray[np.uint8], at_px: NDArray[np.float64], half_px: tuple[float, float], binning: Binning
) -> NDArray[np.float32]:
    """Return the strip of an image about one of its pixels, (2,)."""
    x, y = np.rint(at_px).astype(int).tolist()
    half_x, half_y = (round(half / binning) for half in half_px)
    rows = slice(max(0, y - half_y), y + half_y + 1)
    columns = slice(max(0, x - half_x), x + half_x + 1)
    return np.asarray(image[rows, columns], dtype=np.float32)


def wait_until_still(
    around: PassingDetector,
    wide: Callable[[], Frame],
    clock: Clock,
    *,
    shown: Callable[[Frame], bool] = lambda frame: True,
) -> None:
    """Return when nothing has moved there for `STILL_S`, or else once the target is shown after `LONGEST_S`.

    Return after `HIDDEN_LONGEST_S` in any case. `shown`: whether a wide frame shows the target.
    """
    last = wide()
    began_ns = still_ns = clock.now_ns()
    while (waited_s := (clock.now_ns() - began_ns) / 1e9) < HIDDEN_LONGEST_S:
        if waited_s >= LONGEST_S and shown(last):
            return
        clock.sleep_until_ns(clock.now_ns() + POLL_NS)
        frame = wide()
        if frame.seq == last.seq:
            continue
        if around.differ(last, frame):
            still_ns = clock.now_ns()
        elif clock.now_ns() >= still_ns + round(1e9 * STILL_S):
            return
        last = frame
