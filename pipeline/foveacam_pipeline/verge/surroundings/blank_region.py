"""The blank region of the wide image about a point, and places on its border whose depth can be measured.

An edge between two surfaces belongs to the nearer one: a place on the border is of the region's own surface
or of one in front of it.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning

REDUCED = 2
"""Reduction of the wide image for the search, from the sensor's size: binned images already have that
size."""
SMOOTH_SIGMA_PX = 1.0
"""Standard deviation of the blur before the search, reduced px."""
NOISE_GAIN = 0.28
"""Factor from the image's noise to that of Sobel slope / 8 after the reduction (measured on bare noise)."""
FLAT_NOISES = 4.0
"""A slope below this multiple of its noise counts as flat."""
LEAST_SLOPE = 0.5
"""Slope that shading alone may have, grey levels a reduced px."""
RING_PX = 4
"""Width of the ring around the flat pixels that contains the border's edge, reduced px."""
SECTORS = 8
LEAST_ACROSS = 0.5
"""Least share of the slope along the row: edges along the row do not determine a distance."""
SIDE_REACH_PX = 24
"""Range about a point within which the side of an edge is traced, wide px."""
EDGE_PX = 4
"""Largest distance of an edge from a point beside it, wide px."""
ON_EDGE_PX = 1.2
"""A point farther than this from the flat part of its side lies on the edge itself, wide px."""
EDGE_SHARE = 0.5
"""Slopes below this share of the edge's do not belong to it."""
LEAST_UPRIGHT = 0.6
"""Least share of the border's normal along the row: on a level border the edge behind it may be matched."""
APART_PX = 12.0
"""Least distance between places, wide px."""
RIM_PX = 30
"""Margin to the rim of the wide image within which no place is measured, wide px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlankRegion:
    """A connected region without texture.

    `mask`: (h, w) bool at half the wide image's size. `area_share`: of the whole image. `border_px`: (n, 2)
    places on its border where the brightness changes along the row, wide px, nearest first. `touches_rim`:
    whether it reaches the rim of the image. `at_px`: (2,) the point, wide px. `inward_px`: (h, w) as `mask`,
    each pixel's depth within the region, negative outside, wide px. `binning`: of the image.
    """

    mask: NDArray[np.bool_]
    area_share: float
    border_px: NDArray[np.float64]
    touches_rim: bool
    at_px: NDArray[np.float64]
    inward_px: NDArray[np.float64]
    binning: Binning = 1

    def depth_px(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n,) the distance from wide pixels, (n, 2), to the border, wide px; negative outside."""
        cells = np.rint(pixels / REDUCED).astype(int)
        cells = np.clip(cells, 0, np.array(self.mask.shape[::-1]) - 1)
        return np.asarray(self.inward_px[cells[:, 1], cells[:, 0]])


def blank_region(
    gray: NDArray[np.uint8], at_px: NDArray[np.float64], *, noise: float, places: int, binning: Binning = 1
) -> BlankRegion:
    """Return the region of an (h, w) image about `at_px`, (2,), with at most `places` places on its border.

    `noise`: standard deviation of the image's noise there, grey levels. Places are pixels of the sensor,
    whatever the `binning` of the image.
    """
    reduced = REDUCED // binning
    small = cv2.resize(gray, None, fx=1 / reduced, fy=1 / reduced, interpolation=cv2.INTER_AREA)
    smooth = cv2.GaussianBlur(small.astype(np.float32), (0, 0), SMOOTH_SIGMA_PX)
    slope_x, slope_y = (
        np.asarray(cv2.Sobel(smooth, cv2.CV_32F, dx, dy, scale=1 / 8), dtype=np.float32)
        for dx, dy in ((1, 0), (0, 1))
    )
    slope = cv2.magnitude(slope_x, slope_y)
    flat = (slope < max(LEAST_SLOPE, FLAT_NOISES * NOISE_GAIN * noise * binning)).astype(np.uint8)
    middle = np.clip(np.rint(at_px / REDUCED).astype(int), 0, np.array(small.shape[::-1]) - 1)
    mask = _component(flat, middle)
    return BlankRegion(
        mask=mask,
        area_share=float(mask.mean()),
        border_px=_border(mask, slope_x, np.asarray(slope), at_px, places=places),
        at_px=at_px,
        inward_px=_inward_px(mask),
        binning=binning,
        touches_rim=bool(mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any()),
    )


def _inward_px(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    inside = mask.astype(np.uint8)
    inward, outward = (cv2.distanceTransform(m, cv2.DIST_L2, 3) for m in (inside, 1 - inside))
    return np.asarray(inward - outward, dtype=np.float64) * REDUCED


def side_of_edge(
    picture: NDArray[np.uint8], at_px: NDArray[np.float64], *, binning: Binning = 1
) -> NDArray[np.uint8]:
    """Return (h, w), 255 where an image continues from a point without crossing the edge beside it.

    `picture`: (h, w) or (h, w, 3); an edge of any channel counts. `at_px`: (2,) the point, px of the picture,
    which is binned by `binning`.
    """
    height, width = picture.shape[:2]
    reach, edge = SIDE_REACH_PX // binning, EDGE_PX // binning
    x, y = np.clip(np.rint(at_px).astype(int), 0, (width - 1, height - 1)).tolist()
    rows = slice(max(0, y - reach), y + reach + 1)
    columns = slice(max(0, x - reach), x + reach + 1)
    part = picture[rows, columns].astype(np.float32)
    smooth = cv2.GaussianBlur(part, (0, 0), SMOOTH_SIGMA_PX / binning)
    slope = cv2.magnitude(
        *(cv2.Sobel(smooth, cv2.CV_32F, dx, dy, scale=1 / 8) for dx, dy in ((1, 0), (0, 1)))
    )
    slope = slope.max(axis=2) if slope.ndim == 3 else slope
    own_x, own_y = x - columns.start, y - rows.start
    near = slope[max(0, own_y - edge) : own_y + edge + 1, max(0, own_x - edge) : own_x + edge + 1]
    level = np.asarray(slope < EDGE_SHARE * float(near.max()), dtype=np.uint8)
    _, labels = cv2.connectedComponents(level, connectivity=4)
    ys, xs = np.nonzero(labels > 0)
    mask = np.zeros((height, width), dtype=np.uint8)
    if len(xs):
        nearest = int(np.argmin((xs - own_x) ** 2 + (ys - own_y) ** 2))
        mask[rows, columns] = 255 * (labels == labels[ys[nearest], xs[nearest]])
    return mask


def on_edge(side: NDArray[np.uint8], at_px: NDArray[np.float64], *, binning: Binning = 1) -> bool:
    """Return whether a point lies on an edge itself: too far from its side, as `side_of_edge` returns it."""
    ys, xs = np.nonzero(side)
    return len(xs) == 0 or binning * float(np.hypot(xs - at_px[0], ys - at_px[1]).min()) > ON_EDGE_PX


def _component(flat: NDArray[np.uint8], middle: NDArray[np.int_]) -> NDArray[np.bool_]:
    """Return the connected flat pixels about a place; in texture, the place alone."""
    _, labels = cv2.connectedComponents(flat, connectivity=4)
    x, y = middle.tolist()
    around = labels[max(0, y - 2) : y + 3, max(0, x - 2) : x + 3]
    own = around[around > 0]
    if len(own) == 0:
        mask = np.zeros(flat.shape, dtype=np.bool_)
        mask[y, x] = True
        return mask
    return np.asarray(labels == np.bincount(own).argmax(), dtype=np.bool_)


def _border(
    mask: NDArray[np.bool_],
    slope_x: NDArray[np.float32],
    slope: NDArray[np.float32],
    at_px: NDArray[np.float64],
    *,
    places: int,
) -> NDArray[np.float64]:
    """Return the nearest steep place on the border in each sector about a point, then more distant ones."""
    kernel = np.ones((2 * RING_PX + 1, 2 * RING_PX + 1), dtype=np.uint8)
    ring = (cv2.dilate(mask.astype(np.uint8), kernel) > 0) & ~mask
    steepness = np.abs(slope_x)
    crest = steepness >= cv2.dilate(steepness, np.ones((1, 5), dtype=np.uint8))
    across = (steepness >= LEAST_ACROSS * slope) & (steepness >= 2.0 * LEAST_SLOPE) & _upright(mask)
    ys, xs = np.nonzero(ring & across & crest)
    if len(xs) == 0:
        return np.empty((0, 2))
    edge_px = REDUCED * np.column_stack([xs, ys]).astype(np.float64) + (REDUCED - 1) / 2
    size = REDUCED * np.array(mask.shape[::-1])
    free = ((edge_px >= RIM_PX) & (edge_px <= size - 1 - RIM_PX)).all(axis=1)
    return _spread(edge_px[free], at_px, places)


def _upright(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (h, w) bool: where the border of a mask runs more across the rows than along them."""
    blurred = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), float(RING_PX))
    x, y = (cv2.Sobel(blurred, cv2.CV_32F, dx, dy) for dx, dy in ((1, 0), (0, 1)))
    return np.asarray(np.abs(x) >= LEAST_UPRIGHT * cv2.magnitude(x, y))


def _spread(edge_px: NDArray[np.float64], at_px: NDArray[np.float64], places: int) -> NDArray[np.float64]:
    """Return places that are apart: the nearest one of each sector about a point in turn."""
    offsets = edge_px - at_px
    distance_px = np.hypot(*offsets.T)
    turn = (np.arctan2(offsets[:, 1], offsets[:, 0]) + np.pi) / (2 * np.pi)
    sector = np.floor(turn * SECTORS).astype(int) % SECTORS
    order = np.argsort(distance_px)
    chosen: list[int] = []
    queues = [order[sector[order] == k].tolist() for k in np.unique(sector[order])]
    while len(chosen) < places and any(queues):
        for queue in queues:
            while queue:
                index = queue.pop(0)
                apart_px = np.hypot(*(edge_px[index] - edge_px[chosen]).T)
                if (apart_px >= APART_PX).all():
                    chosen.append(index)
                    break
    chosen = chosen[:places]
    return np.asarray(edge_px[sorted(chosen, key=lambda k: float(distance_px[k]))], dtype=np.float64)
