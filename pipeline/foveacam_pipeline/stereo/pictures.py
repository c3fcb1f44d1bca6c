"""Pictures of a stereo look: anaglyph, left-right difference, depth as colours with a scale."""

from enum import StrEnum
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.values import DepthMap, RectifiedPair

BAR_WIDTH = 112
"""Width of the scale of a depth picture 540 px high, px; it scales with the height."""
BACKGROUND = (17, 20, 26)
FOREGROUND = (214, 220, 228)
HOLE = ((38, 42, 50), (52, 57, 66))
"""Two shades of the diagonal stripes that mark pixels without depth."""
STRIPE_PX = 6
STEPS_M = (1.0, 2.0, 2.5, 5.0)


class AnaglyphStyle(StrEnum):
    """Colours of the left and the right eye's glass."""

    RED_CYAN = "red_cyan"
    RED_BLUE = "red_blue"
    CYAN_RED = "cyan_red"
    BLUE_RED = "blue_red"


CHANNELS = {"red": (0,), "blue": (2,), "cyan": (1, 2)}


def anaglyph(pair: RectifiedPair, style: AnaglyphStyle = AnaglyphStyle.RED_CYAN) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8: each eye in the colour of its glass; parts that one eye sees are dimmed."""
    picture = overlay_eyes(pair.left, pair.right, style)
    picture[~(pair.valid_left & pair.valid_right)] //= 3
    return picture


def overlay_eyes(
    left: NDArray[np.uint8], right: NDArray[np.uint8], style: AnaglyphStyle = AnaglyphStyle.RED_CYAN
) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8: two pictures of one size, each in the colour of its glass."""
    picture = np.zeros((*left.shape[:2], 3), dtype=np.uint8)
    for colour, eye in zip(style.value.split("_"), (left, right), strict=True):
        picture[..., CHANNELS[colour]] = gray(eye)[..., None]
    return picture


def difference(pair: RectifiedPair) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8: left minus right about middle grey, after equalising the mean brightness."""
    both = pair.valid_left & pair.valid_right
    picture = subtract_eyes(pair.left, pair.right, both)
    picture[~both] = BACKGROUND
    return picture


def subtract_eyes(
    left: NDArray[np.uint8], right: NDArray[np.uint8], both: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return (h, w, 3) uint8: left minus right about middle grey, equally bright where `both` is true."""
    grey_left, grey_right = gray(left).astype(np.int16), gray(right).astype(np.int16)
    shift = 0
    if both.any():
        shift = round(float(grey_left[both].mean() - grey_right[both].mean()))
    signed = np.clip(128 + grey_left - grey_right - shift, 0, 255).astype(np.uint8)
    return np.stack([signed, signed, signed], axis=2)


def depth_picture(
    depth: DepthMap, *, near_m: float | None = None, far_m: float | None = None
) -> NDArray[np.uint8]:
    """Return (h, w + bar, 3) uint8: depth as colours, near warm, with a scale in metres; holes are striped.

    Without `near_m` and `far_m` the scale spans the depths present, without the outer 2 % at either end.
    """
    known = np.isfinite(depth.z_m)
    if near_m is None or far_m is None:
        low, high = depth_span(depth.z_m)
        near_m, far_m = low if near_m is None else near_m, high if far_m is None else far_m
    low, high = near_m, max(far_m, near_m + 1e-3)
    share = np.zeros(depth.z_m.shape, dtype=np.float32)
    np.divide(high - depth.z_m, high - low, out=share, where=known)
    colours = _colours(share)
    np.copyto(colours, _stripes(depth.z_m.shape), where=~known[:, :, None])
    bar = _bar(depth.z_m.shape[0], low, high, coverage=float(known.mean()))
    return np.concatenate([colours, bar], axis=1)


def depth_span(z_m: NDArray[np.float32]) -> tuple[float, float]:
    """Return nearest and farthest depth, m, of a scale for `z_m` (h, w), without the outer 2 %, with margins.

    Depths that are not finite do not count; without any the scale is 1 to 30 m.
    """
    known = z_m[np.isfinite(z_m)]
    if not known.size:
        return 1.0, 30.0
    low, high = (float(q) for q in np.percentile(known, (2, 98)))
    margin = max(0.1 * (high - low), 0.002 * high)
    return low - margin, high + margin


def _colours(share: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return RGB of shares 0 (far, blue) to 1 (near, red)."""
    level = np.clip(np.rint(share * 255.0), 0, 255).astype(np.uint8)
    painted = cv2.applyColorMap(level, cv2.COLORMAP_TURBO)
    return np.asarray(cv2.cvtColor(painted, cv2.COLOR_BGR2RGB), dtype=np.uint8)


@lru_cache(maxsize=4)
def _stripes(shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return the picture of holes, read-only; it takes 10 ms for 720 x 540, so live views use it again."""
    rows, columns = np.indices(shape[:2])
    odd = ((rows + columns) // STRIPE_PX) % 2 == 1
    stripes = np.where(odd[:, :, None], HOLE[1], HOLE[0]).astype(np.uint8)
    stripes.setflags(write=False)
    return stripes


def _bar(height: int, low_m: float, high_m: float, *, coverage: float) -> NDArray[np.uint8]:
    """Return the scale (height, bar width, 3): near at the bottom, round depths labelled, holes explained."""
    zoom = height / 540.0
    width = round(BAR_WIDTH * zoom)
    panel = np.full((height, width, 3), BACKGROUND, dtype=np.uint8)
    top, bottom = round(46 * zoom), height - round(62 * zoom)
    left, right = round(14 * zoom), round(34 * zoom)
    ramp = np.linspace(0.0, 1.0, bottom - top, dtype=np.float32)[:, None]
    panel[top:bottom, left:right] = _colours(np.repeat(ramp, right - left, axis=1))
    cv2.rectangle(panel, (left - 1, top - 1), (right, bottom), FOREGROUND, 1)
    _text(panel, "depth z", (left, round(28 * zoom)), zoom)
    for value_m in _ticks(low_m, high_m):
        y = round(bottom - 1 - (value_m - low_m) / (high_m - low_m) * (bottom - 1 - top))
        cv2.line(panel, (right, y), (right + round(5 * zoom), y), FOREGROUND, 1)
        _text(panel, _label(value_m, high_m - low_m), (right + round(9 * zoom), y + round(5 * zoom)), zoom)
    swatch = round(14 * zoom)
    y = height - round(38 * zoom)
    panel[y : y + swatch, left : left + swatch] = _stripes((swatch, swatch))
    cv2.rectangle(panel, (left - 1, y - 1), (left + swatch, y + swatch), FOREGROUND, 1)
    label = f"none {100.0 * (1.0 - coverage):.0f} %"
    _text(panel, label, (left + swatch + round(6 * zoom), y + round(12 * zoom)), zoom)
    return np.asarray(panel, dtype=np.uint8)


def _ticks(low_m: float, high_m: float) -> list[float]:
    """Return round depths in the span, about five of them."""
    rough = (high_m - low_m) / 5.0
    decade = 10.0 ** np.floor(np.log10(rough))
    step = next((s * decade for s in STEPS_M if s * decade >= rough), 10.0 * decade)
    first = int(np.ceil(low_m / step))
    last = int(np.floor(high_m / step))
    return [k * step for k in range(first, last + 1)]


def _label(value_m: float, span_m: float) -> str:
    digits = int(np.clip(2 - np.floor(np.log10(span_m)), 0, 4))
    return f"{value_m:.{digits}f} m"


def _text(panel: NDArray[np.uint8], text: str, origin_px: tuple[int, int], zoom: float) -> None:
    cv2.putText(panel, text, origin_px, FOREGROUND, cv2.FontFace("sans"), max(8, round(14 * zoom)), 400)
