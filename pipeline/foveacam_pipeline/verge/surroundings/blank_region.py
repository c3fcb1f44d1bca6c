"""The blank region of the wide image about a point, and places on its border whose depth can be measured.

An edge between two surfaces moves with the nearer one: a place on the border is of the region's own surface
or of one in front of it.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning

REDUCED = 2
"""The wide image is searched at half its sensor's size, which is a binned one's own."""
SMOOTH_SIGMA_PX = 1.0
"""Of the search, reduced px."""
NOISE_GAIN = 0.28
"""Noise left by smoothing and halving, times this for the Sobel slope / 8 (measured on bare noise)."""
FLAT_NOISES = 4.0
"""A slope below so many times its noise is flat."""
LEAST_SLOPE = 0.5
"""Slope that shading alone may have, grey levels a reduced px."""
RING_PX = 4
"""The border's edge lies within so many reduced px of the flat pixels."""
SECTORS = 8
LEAST_ACROSS = 0.5
"""Least share of the slope along the row: edges along the row tell no distance."""
SIDE_REACH_PX = 24
"""How far the side of an edge is followed, wide px."""
EDGE_PX = 4
"""An edge beside a point lies within so many wide px."""
ON_EDGE_PX = 1.2
"""A point farther than this from what is level on its side lies on the edge itself, wide px."""
EDGE_SHARE = 0.5
"""Slopes below this share of the edge's do not belong to it."""
LEAST_UPRIGHT = 0.6
"""Least share of the border's own normal along the row: what is seen behind a level edge is not the edge."""
APART_PX = 12.0
"""Places lie at least so far apart, wide px."""
RIM_PX = 30
"""Nothing is measured so near to the rim of the wide image, wide px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlankRegion:
    """A connected region without texture.

    `mask`: (h, w) bool at half the wide image's size. `area_share`: of the whole image. `border_px`: (n, 2)
    places on its border where the brightness changes along the row, wide px, nearest first.
    `touches_rim`: whether it reaches the rim of the image. `at_px`: (2,) the point, wide px. `inward_px`:
    (h, w) as `mask`, how deep each of its pixels lies within the region, negative outside, wide px.
    `binning`: of the image.
    """

    mask: NDArray[np.bool_]
    area_share: float
    border_px: NDArray[np.float64]
    touches_rim: bool
    at_px: NDArray[np.float64]
    inward_px: NDArray[np.float64]
    binning: Binning = 1

    def depth_px(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n,) how deep wide pixels, (n, 2), lie within the region; negative outside, wide px."""
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
    gray: NDArray[np.uint8], at_px: NDArray[np.float64], *, binning: Binning = 1
) -> NDArray[np.uint8]:
    """Return (h, w), 255 where an image continues from a point without crossing the edge beside it.

    `at_px`: (2,) the point, px of the image, which is binned by `binning`.
    """
    height, width = gray.shape
    reach, edge = SIDE_REACH_PX // binning, EDGE_PX // binning
    x, y = np.clip(np.rint(at_px).astype(int), 0, (width - 1, height - 1)).tolist()
    rows = slice(max(0, y - reach), y + reach + 1)
    columns = slice(max(0, x - reach), x + reach + 1)
    part = gray[rows, columns].astype(np.float32)
    smooth = cv2.GaussianBlur(part, (0, 0), SMOOTH_SIGMA_PX / binning)
    slope = cv2.magnitude(
        *(cv2.Sobel(smooth, cv2.CV_32F, dx, dy, scale=1 / 8) for dx, dy in ((1, 0), (0, 1)))
    )
    own_x, own_y = x - columns.start, y - rows.start
    near = slope[max(0, own_y - edge) : own_y + edge + 1, max(0, own_x - edge) : own_x + edge + 1]
    level = np.asarray(slope < EDGE_SHARE * float(near.max()), dtype=np.uint8)
    _, labels = cv2.connectedComponents(level, connectivity=4)
    ys, xs = np.nonzero(labels > 0)
    mask = np.zeros(gray.shape, dtype=np.uint8)
    if len(xs):
        nearest = int(np.argmin((xs - own_x) ** 2 + (ys - own_y) ** 2))
        mask[rows, columns] = 255 * (labels == labels[ys[nearest], xs[nearest]])
    return mask


def on_edge(side: NDArray[np.uint8], at_px: NDArray[np.float64], *, binning: Binning = 1) -> bool:
    """Return whether a point lies on an edge itself, too far from its side, the answer of `side_of_edge`."""
    ys, xs = np.nonzero(side)
    return len(xs) == 0 or binning * float(np.hypot(xs - at_px[0], ys - at_px[1]).min()) > ON_EDGE_PX


def _component(flat: NDArray[np.uint8], middle: NDArray[np.int_]) -> NDArray[np.bool_]:
    """Return the connected flat pixels about a place; about a textured one, the place itself."""
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
    """Return the nearest steep place on the border in each sector about a point, then further ones."""
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
    """Return places far from each other: in turns the nearest ones of each sector about a point."""
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
