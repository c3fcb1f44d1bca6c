"""Pictures of the vergence loop: the match in the guide strip, and step responses before and after tuning."""

import io

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.continuous_loop.autotune import TuneResult
from foveacam_pipeline.continuous_loop.guide_match import EyeInStrip, GuideMatch
from foveacam_pipeline.continuous_loop.settings import Axis
from foveacam_pipeline.continuous_loop.step_response import SETTLED_SHARE, StepResponse
from foveacam_pipeline.diagrams import new_figure

LEFT_RGB, RIGHT_RGB, TARGET_RGB = (255, 120, 90), (80, 170, 255), (255, 225, 80)
GAP_PX = 6
CAPTION_PX = 18
STRIP_SPREAD = 3.0
"""Display range of the strip: mean plus and minus this many standard deviations."""
NAMES = {Axis.PAN_X: "pan", Axis.VERGE: "vergence", Axis.SHIFT_Y: "vertical shift"}
DPI = 110


def match_picture(match: GuideMatch) -> NDArray[np.uint8]:
    """Return the guide strip with both eyes' boxes above each eye's correlation map, (h, w, 3) uint8 RGB.

    Maps are aligned with the strip: a score lies in the column of its box's centre.
    """
    parts = [_captioned(_strip(match), f"wide view about the target, {match.f_px:.0f} px focal length")]
    for name, eye, colour in (("left", match.left, LEFT_RGB), ("right", match.right, RIGHT_RGB)):
        parts.append(_captioned(_map(match, eye, colour), f"{name} eye, correlation {eye.score:.2f}"))
    width = match.strip.shape[1]
    gap = np.zeros((GAP_PX, width, 3), dtype=np.uint8)
    stacked = [part for one in parts for part in (one, gap)][:-1]
    return np.concatenate(stacked)


def _strip(match: GuideMatch) -> NDArray[np.uint8]:
    strip = match.strip
    spread = STRIP_SPREAD * float(strip.std()) or 1.0
    grey = np.clip(127.5 * (1.0 + (strip - strip.mean()) / spread), 0, 255).astype(np.uint8)
    picture = np.ascontiguousarray(np.repeat(grey[:, :, None], 3, axis=2))
    for eye, colour in ((match.left, LEFT_RGB), (match.right, RIGHT_RGB)):
        _draw_box(picture, eye, colour)
    middle_y, middle_x = ((side - 1) // 2 for side in strip.shape)
    cv2.drawMarker(picture, (middle_x, middle_y), TARGET_RGB, cv2.MARKER_CROSS, 15, 1, cv2.LINE_AA)
    return picture


def _draw_box(picture: NDArray[np.uint8], eye: EyeInStrip, colour: tuple[int, int, int]) -> None:
    x, y = eye.middle_px
    width, height = eye.size_px
    corner = round(x - (width - 1) / 2), round(y - (height - 1) / 2)
    cv2.rectangle(picture, corner, (corner[0] + width - 1, corner[1] + height - 1), colour, 1, cv2.LINE_AA)
    cv2.drawMarker(picture, (round(x), round(y)), colour, cv2.MARKER_TILTED_CROSS, 9, 1, cv2.LINE_AA)


def _map(match: GuideMatch, eye: EyeInStrip, colour: tuple[int, int, int]) -> NDArray[np.uint8]:
    """Return a correlation map as wide as the strip, 0 dark to 1 bright, with a ring about its maximum."""
    shown = cv2.applyColorMap((np.clip(eye.scores, 0.0, 1.0) * 255).astype(np.uint8), cv2.COLORMAP_INFERNO)
    rows, columns = eye.scores.shape
    picture = np.zeros((rows, match.strip.shape[1], 3), dtype=np.uint8)
    left = (eye.size_px[0] - 1) // 2
    picture[:, left : left + columns] = shown[:, :, ::-1]
    y = round(eye.middle_px[1] - (eye.size_px[1] - 1) / 2)
    cv2.circle(picture, (round(eye.middle_px[0]), y), 8, colour, 1, cv2.LINE_AA)
    return picture


def _captioned(picture: NDArray[np.uint8], words: str) -> NDArray[np.uint8]:
    bar = np.zeros((CAPTION_PX, picture.shape[1], 3), dtype=np.uint8)
    cv2.putText(
        bar, words, (4, CAPTION_PX - 5), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (220, 220, 220), 1, cv2.LINE_AA
    )
    return np.concatenate([bar, picture])


def tune_picture(result: TuneResult, *, form: str = "png") -> bytes:
    """Return a plot of each loop's step response before and after tuning; `form`: png or svg."""
    figure = new_figure((10.5, 3.4), dpi=DPI)
    for axes, (axis, after) in zip(figure.subplots(1, len(result.after)), result.after.items(), strict=True):
        for response, name, colour in (
            (result.before[axis], "before", "#888888"),
            (after, "tuned", "#d95f02"),
        ):
            label = f"{name}: {_settled(response)}"
            axes.plot(1e3 * response.t_s, 100.0 * response.share, "o-", color=colour, ms=3.5, label=label)
        axes.axhspan(100.0 * (1.0 - SETTLED_SHARE), 100.0 * (1.0 + SETTLED_SHARE), color="0.5", alpha=0.2)
        axes.set_title(NAMES.get(axis, axis.value), fontsize=10)
        axes.set_xlabel("time after the step, ms")
        axes.grid(visible=True, alpha=0.3)
        axes.legend(fontsize=8, loc="lower right")
    figure.axes[0].set_ylabel("response, % of the step")
    buffer = io.BytesIO()
    figure.savefig(buffer, format=form)
    return buffer.getvalue()


def _settled(response: StepResponse) -> str:
    settle_s = response.settle_s
    overshoot = f"overshoot {100.0 * response.overshoot:.0f} %"
    return f"not settled, {overshoot}" if settle_s is None else f"{1e3 * settle_s:.0f} ms, {overshoot}"
