"""The unit in which times are compared between machines: bare OpenCV matching a binned pair on one core."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median

import cv2
import numpy as np

WIDTH, HEIGHT, DISPARITIES, BLOCK = 720, 540, 64, 5
SHIFT_PX = 24
RUNS = 7


def reference_ms(*, runs: int = RUNS) -> float:
    """Return the CPU time of OpenCV's SGBM on noise and its shifted copy, ms: median of some runs."""
    rng = np.random.default_rng(5)
    noise = rng.normal(size=(HEIGHT, WIDTH + SHIFT_PX))
    picture = np.clip(128.0 + 120.0 * cv2.GaussianBlur(noise, (0, 0), 1.5), 0, 255).astype(np.uint8)
    left, right = (np.ascontiguousarray(picture[:, first : first + WIDTH]) for first in (0, SHIFT_PX))
    matcher = cv2.StereoSGBM.create(minDisparity=0, numDisparities=DISPARITIES, blockSize=BLOCK)
    times_ms = []
    with one_thread():
        for _ in range(runs + 1):
            began_s = time.thread_time()
            matcher.compute(left, right)
            times_ms.append(1e3 * (time.thread_time() - began_s))
    return median(times_ms[1:])


@contextmanager
def one_thread() -> Iterator[None]:
    """Let OpenCV use the calling thread alone."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
