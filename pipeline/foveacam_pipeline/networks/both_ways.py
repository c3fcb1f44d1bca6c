"""Both eyes' answers made one: a network run on a pair, and on the mirrored pair with exchanged eyes.

Both runs see the same surfaces at the same disparities. A network is not symmetric by itself; the mean of
both answers is: a point has one disparity whichever eye it is told for, and errors of one run alone show.
"""

import cv2
import numpy as np

from foveacam_pipeline.stereo.refine import FloatImage

AGREE_PX = 2.0
"""Answers that are farther apart are of two surfaces, or one of them is wrong: no mean is taken."""

LEAST_VARIANCE_PX2 = np.float32(1e-12)
"""Of both eyes together: a network may state no error at all."""


def mean_of_eyes(left_px: FloatImage, mirrored_px: FloatImage) -> FloatImage:
    """Return the left eye's disparities (h, w), px, averaged with the right eye's where the two agree.

    `mirrored_px`: the answer to `RectifiedPair.mirrored`, as it is.
    """
    equal = np.ones_like(left_px)
    return surer_of_eyes((left_px, equal), (mirrored_px, equal))[0]


def surer_of_eyes(
    left: tuple[FloatImage, FloatImage], mirrored: tuple[FloatImage, FloatImage]
) -> tuple[FloatImage, FloatImage]:
    """Return disparity and standard deviation, px, from those of the pair and of the mirrored one.

    Where both agree their mean is weighted by the variances that they state; half their difference is added
    to the deviation in any case. Where the right window ends, the left eye's stay as they are.
    """
    left_px, left_sigma_px = left
    other_px, other_sigma_px = (_at_left(part, left_px) for part in mirrored)
    known = np.isfinite(other_px)
    apart_px = np.where(known, np.abs(left_px - other_px), np.float32(0.0))
    near = known & (apart_px <= AGREE_PX)
    both_px2 = np.maximum(left_sigma_px**2 + other_sigma_px**2, LEAST_VARIANCE_PX2)
    share = np.where(near, left_sigma_px**2 / both_px2, np.float32(0.0))
    mean_px = left_px + share * np.where(near, other_px - left_px, np.float32(0.0))
    other_part = share * np.where(near, other_sigma_px, np.float32(0.0))
    sigma_px = np.sqrt(((1.0 - share) * left_sigma_px) ** 2 + other_part**2 + (apart_px / 2) ** 2)
    return mean_px.astype(np.float32), sigma_px.astype(np.float32)


def _at_left(mirrored: FloatImage, left_px: FloatImage) -> FloatImage:
    """Return the mirrored pair's answer at each pixel of the left window; NaN beyond the right one."""
    height, width = left_px.shape
    columns = np.float32(width - 1) - (np.arange(width, dtype=np.float32)[None, :] - left_px)
    rows = np.repeat(np.arange(height, dtype=np.float32)[:, None], width, axis=1)
    found = cv2.remap(mirrored, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    found[(columns < 0.0) | (columns > np.float32(width - 1))] = np.nan
    return np.asarray(found, dtype=np.float32)
