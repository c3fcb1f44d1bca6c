"""The unit in which times are compared between machines: bare semi-global matching by OpenCV.

Machines differ by a factor of two and more, so each time of `foveacam bench pace` is stated as a multiple of
`reference_ms` as well, which is measured in the same run.
"""

import time
from statistics import median

import cv2
import numpy as np

from foveacam_bench.figures import Figures

SIZE_PX = (720, 540)
DISPARITIES = 64
BLOCK_PX = 5
RUNS = 9
SEED = 3
_SECONDS_BY_UNIT = {"_s": 1.0, "_ms": 1e-3}


def reference_ms() -> float:
    """Return the CPU time of one match of a textured pair, ms: the median, on one thread."""
    width, height = SIZE_PX
    wide = np.random.default_rng(SEED).integers(0, 256, (height, width + DISPARITIES), dtype=np.uint8)
    left = cv2.GaussianBlur(wide, (0, 0), 1.4)
    right = np.ascontiguousarray(np.roll(left, -DISPARITIES // 3, axis=1)[:, :width])
    left = np.ascontiguousarray(left[:, :width])
    matcher = cv2.StereoSGBM.create(
        numDisparities=DISPARITIES, blockSize=BLOCK_PX, P1=8 * BLOCK_PX**2, P2=32 * BLOCK_PX**2
    )
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return round(1e3 * median(_cpu_s(matcher, left, right) for _ in range(RUNS)), 2)
    finally:
        cv2.setNumThreads(threads)


def _cpu_s(matcher: cv2.StereoSGBM, left: cv2.typing.MatLike, right: cv2.typing.MatLike) -> float:
    began_s = time.process_time()
    matcher.compute(left, right)
    return time.process_time() - began_s


def with_multiples(figures: Figures, *, reference_ms: float) -> Figures:
    """Return the figures, and each time among them as a multiple of the reference, `…_over_reference`."""
    found: Figures = {"reference_ms": reference_ms}
    for name, value in figures.items():
        found[name] = value
        seconds = next((s for unit, s in _SECONDS_BY_UNIT.items() if _has_unit(name, unit)), None)
        if seconds is not None and isinstance(value, float | int):
            found[f"{name}_over_reference"] = round(value * seconds / (1e-3 * reference_ms), 2)
        elif seconds is not None:
            found[f"{name}_over_reference"] = None
    return found


def _has_unit(name: str, unit: str) -> bool:
    """Return whether a name has a unit, at its end or before a statistic of several values."""
    return name.endswith(unit) or any(f"{unit}_{stated}" in name for stated in ("median", "p90", "per_"))
