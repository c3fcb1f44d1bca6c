"""Detect movement near a target: people cross a line of sight for about a second.

An eye's view may be crossed beside the target as the wide view has it: by half the baseline over the depth
of who passes. So a strip along the row is watched, as far as somebody at 1.3 m may appear.
"""

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Clock, Frame
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.matching.texture import noise_level

STRIP_PX = (160, 32)
"""Half sides of the strip, wide px: half a baseline of 0.12 m at 1.2 m."""
BLUR_SIGMA_PX = 2.0
LEAST_CHANGE = 6.0
"""Brightness that changes by less may be the wide camera's noise, its standard deviations after the blur."""
MOVED_SHARE = 0.01
"""At least such a share of the strip has changed when something moves in it."""
LONGEST_S = 2.0
STILL_S = 0.2
"""Nothing has moved for so long: it is over."""
POLL_NS = 50_000_000


class PassingDetector:
    """The strip of the wide view about a target."""

    def __init__(self, wide: Intrinsics, target: NDArray[np.float64]) -> None:
        """`target`: (2,) tangents from the rig's origin."""
        self._at_px = np.asarray(wide.pixels(np.arctan(target)[None])[0], dtype=np.float64)

    def differ(self, one: Frame, other: Frame) -> bool:
        """Return whether something moved there between two wide frames."""
        images = [gray(to_uint8(frame)) for frame in (one, other)]
        noise = noise_level(images[0], at_px=self._at_px)
        before, after = (cv2.GaussianBlur(self._strip(image), (0, 0), BLUR_SIGMA_PX) for image in images)
        blurred_noise = math.sqrt(2.0) * noise / (2.0 * math.sqrt(math.pi) * BLUR_SIGMA_PX)
        change = np.abs(after - before)
        return float(np.mean(change > LEAST_CHANGE * blurred_noise)) > MOVED_SHARE

    def _strip(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        x, y = np.rint(self._at_px).astype(int).tolist()
        half_x, half_y = STRIP_PX
        rows = slice(max(0, y - half_y), y + half_y + 1)
        columns = slice(max(0, x - half_x), x + half_x + 1)
        return np.asarray(image[rows, columns], dtype=np.float32)


def wait_until_still(around: PassingDetector, wide: Callable[[], Frame], clock: Clock) -> None:
    """Return when nothing has moved there for a moment, or after two seconds all the same."""
    last = wide()
    began_ns = still_ns = clock.now_ns()
    while clock.now_ns() < began_ns + round(1e9 * LONGEST_S):
        clock.sleep_until_ns(clock.now_ns() + POLL_NS)
        frame = wide()
        if frame.seq == last.seq:
            continue
        if around.differ(last, frame):
            still_ns = clock.now_ns()
        elif clock.now_ns() >= still_ns + round(1e9 * STILL_S):
            return
        last = frame
