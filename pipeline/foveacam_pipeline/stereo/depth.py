"""Convert disparity to metres: depth with its error for every pixel, and a point cloud in the rig frame.

Z = f B / d is exact off the axis as on it (the virtual pinholes are parallel); its error is Z^2 / (B f)
times that of d (Sec. 4.1). Independent of how the disparity was measured.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.geometry.triangulate import points_from_plane
from foveacam_pipeline.stereo.values import Cloud, DepthMap, DisparityMap, RectifiedPair

EDGE_JUMP_PX = 2.0
"""A pixel lies on an edge, and may be of either side, if disparity in its 5 x 5 window varies by more."""
EDGE_WINDOW = 5


def depth_map(pair: RectifiedPair, disparity: DisparityMap) -> DepthMap:
    """Return depth along the rig's z for every left pixel; NaN where none is known or finite."""
    f_b = np.float32(pair.f_px * pair.baseline_m)
    total = disparity.residual_px + np.float32(pair.offset_px)
    total[~(total > 0.0)] = np.nan
    z = np.divide(f_b, total, out=total)
    per_px = z * z
    per_px /= f_b
    sigma = per_px * disparity.sigma_px
    per_px *= np.float32(pair.pose_sigma_px)
    return DepthMap(
        z_m=z, sigma_m=sigma, pose_sigma_m=per_px, occluded=disparity.occluded, wrong=disparity.wrong
    )


def cloud(pair: RectifiedPair, depth: DepthMap, max_points: int = 50_000) -> Cloud:
    """Return at most `max_points` points of the rig frame with colour and error, without edge pixels.

    The sigma of a point combines its matching error with the pose error that all points share.
    """
    if max_points < 1:
        raise InvalidInput(f"cloud of {max_points} points: at least 1 is needed")
    usable = np.isfinite(depth.z_m) & ~edge_mask(pair, depth)
    step = max(1, math.isqrt(max(0, int(np.count_nonzero(usable)) - 1) // max_points) + 1)
    while True:
        offset = step // 2
        grid = (slice(offset, None, step), slice(offset, None, step))
        ys, xs = np.nonzero(usable[grid])
        if len(xs) <= max_points:
            break
        step += 1
    rows, columns = ys * step + offset, xs * step + offset
    sigma = np.hypot(depth.sigma_m[rows, columns], depth.pose_sigma_m[rows, columns])
    return Cloud(
        points_rig_m=points_rig_m(pair, columns, rows, depth.z_m[rows, columns]),
        colors=rgb(pair.left)[rows, columns],
        sigma_m=np.asarray(sigma, dtype=np.float32),
    )


def points_rig_m(
    pair: RectifiedPair,
    columns_px: NDArray[np.intp],
    rows_px: NDArray[np.intp],
    z_m: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Return (n, 3) float32 points of left window pixels (n,), (n,) at depths (n,) along the rig's z."""
    plane = np.column_stack([columns_px + pair.u0_left_px, rows_px + pair.v0_px])
    points = points_from_plane(plane, z_m, f_px=pair.f_px, baseline_m=pair.baseline_m)
    return points.astype(np.float32)


def disparity_px(pair: RectifiedPair, depth: DepthMap) -> NDArray[np.float32]:
    """Return (h, w) float32 total disparity of a depth map, px; NaN where unknown."""
    f_b = np.float32(pair.f_px * pair.baseline_m)
    return np.asarray(f_b / depth.z_m, dtype=np.float32)


def edge_mask(pair: RectifiedPair, depth: DepthMap) -> NDArray[np.bool_]:
    """Return (h, w) bool: the known pixels near a jump of depth. Unknown neighbours do not count."""
    disparity = disparity_px(pair, depth)
    unknown = ~np.isfinite(disparity)
    kernel = np.ones((EDGE_WINDOW, EDGE_WINDOW), dtype=np.uint8)
    high = cv2.dilate(np.where(unknown, np.float32(-1e9), disparity), kernel)
    low = cv2.erode(np.where(unknown, np.float32(1e9), disparity), kernel)
    return np.asarray((high - low > np.float32(EDGE_JUMP_PX)) & ~unknown, dtype=np.bool_)


def rgb(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8 RGB of a grey or colour image."""
    if image.ndim == 3:
        return image
    return np.repeat(image[:, :, None], 3, axis=2)
