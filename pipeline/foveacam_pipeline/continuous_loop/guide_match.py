"""Locates both foveae in the guide strip: a strip of the wide view about the target.

The centre of each fovea, reduced to the strip's scale, is the template of a normalised cross-correlation
with the strip. The two positions give the errors of pan, vergence and vertical shift that the loop corrects,
without a calibration of the mirrors.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_pipeline.matching.correlation import peak, score_map
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import Gazes, gazes_under
from foveacam_pipeline.verge.distance import LocatedPoint, triangulate
from foveacam_pipeline.verge.matching.fine import MatchGuess, match_fine
from foveacam_pipeline.verge.matching.survey import reduce_look
from foveacam_pipeline.verge.matching.wide_patch import cut_view

LARGEST_ENLARGEMENT = 4.0
NEEDLE_SHARE = 0.5
"""Share of a fovea's field, each way, used as template: its rim may show another depth."""
ROWS_APART = 0.3
"""Penalty on the sum of both scores when the eyes' rows differ from the commanded shift by a quarter of the
template's height; grows with the square."""
FINE_SCORE = 0.7
REACH_PX = (60, 24)
"""Search range of the fine match about the disparity from the strip, fovea px."""
COARSE_SIGMA_PX = 6.0
"""Standard error of the disparity measured in the strip, fovea px: a fifth of a wide px in each eye."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyeInStrip:
    """Position of one fovea in the strip.

    `tangents`: (2,) direction from the wide camera. `score`: correlation, -1 to 1. `middle_px`, `size_px`:
    its box in the strip. `scores`: (h, w) float32, the correlation for each position of the box's corner.
    """

    tangents: NDArray[np.float64]
    score: float
    middle_px: tuple[float, float]
    size_px: tuple[int, int]
    scores: NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GuideMatch:
    """Both eyes in the strip, (h, w) float32 with evened contrast, about `target`, (2,) tangents."""

    strip: NDArray[np.float32]
    target: NDArray[np.float64]
    f_px: float
    left: EyeInStrip
    right: EyeInStrip

    @property
    def score(self) -> float:
        """Correlation of the weaker eye."""
        return min(self.left.score, self.right.score)


def guide_f_px(calibration: Calibration, settings: LoopSettings) -> float:
    """Return the focal length of the strip, px."""
    return calibration.wide.fx_px * (1.0 + (LARGEST_ENLARGEMENT - 1.0) * settings.template_scale)


def match_guide(
    sighting: Sighting,
    calibration: Calibration,
    target: NDArray[np.float64],
    settings: LoopSettings,
    *,
    lower_rad: float = 0.0,
) -> GuideMatch:
    """Find both foveae of a look in the strip about `target`, (2,) tangents.

    `lower_rad`: by how much the left eye is steered lower than the right.
    """
    f_px = guide_f_px(calibration, settings)
    look = reduce_look(sighting, calibration, f_px=f_px)
    height, width = look.left.image.shape
    half = (round(settings.expand_x * width / 2), round(settings.expand_y * height / 2))
    strip = cut_view(gray(to_uint8(sighting.wide)), calibration.wide, target, f_px=f_px, half=half)
    needles = [_middle(eye.image) for eye in (look.left, look.right)]
    scores = [score_map(strip, needle) for needle in needles]
    rows = _rows(scores[0], scores[1], lower_px=lower_rad * f_px, quarter_px=needles[0].shape[0] / 4.0)
    left, right = (
        _place(found, row, needle.shape, strip.shape, target, f_px)
        for found, row, needle in zip(scores, rows, needles, strict=True)
    )
    return GuideMatch(strip=strip, target=target, f_px=f_px, left=left, right=right)


def _rows(
    left: NDArray[np.float32], right: NDArray[np.float32], *, lower_px: float, quarter_px: float
) -> tuple[int, int]:
    """Return the row of each score map that maximises the joint score: sum of both less the row penalty."""
    best_left, best_right = left.max(axis=1), right.max(axis=1)
    rows = np.arange(left.shape[0])
    apart = (rows[:, None] - rows[None] - lower_px) / quarter_px
    together = best_left[:, None] + best_right[None] - ROWS_APART * apart**2
    row, other = np.unravel_index(int(np.argmax(together)), together.shape)
    return int(row), int(other)


def _place(
    scores: NDArray[np.float32],
    row: int,
    size: tuple[int, ...],
    strip: tuple[int, ...],
    target: NDArray[np.float64],
    f_px: float,
) -> EyeInStrip:
    """Return the score maximum within one row of `row`, to a fraction of a pixel."""
    first = max(0, row - 1)
    x, y, score = peak(scores[first : row + 2])
    height, width = size
    middle = np.array([x + (width - 1) / 2, first + y + (height - 1) / 2])
    strip_middle = (np.array(strip[::-1]) - 1) / 2
    return EyeInStrip(
        tangents=target + (middle - strip_middle) / f_px,
        score=score,
        middle_px=(float(middle[0]), float(middle[1])),
        size_px=(width, height),
        scores=scores,
    )


def _middle(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the central part of a picture with odd sides, exactly about its centre."""
    height, width = image.shape
    rows, columns = (round(side * (1.0 - NEEDLE_SHARE) / 2) for side in (height, width))
    return np.ascontiguousarray(image[rows : height - rows, columns : width - columns])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoopErrors:
    """Control errors, (4,) rad in the order of `AXES`, and the triangulated point at which the eyes look.

    `fine`: vergence and shift are from a left-right match of the foveae, otherwise from the strip alone.
    """

    values_rad: NDArray[np.float64]
    point: LocatedPoint | None
    fine: bool


def errors_of(
    sighting: Sighting, calibration: Calibration, guide: GuideMatch, target: NDArray[np.float64]
) -> LoopErrors:
    """Measure the errors of a look at `target`, (2,) tangents from the wide camera."""
    left, right = guide.left.tangents, guide.right.tangents
    pan = target - (left + right) / 2.0
    apart = right - left
    # the strip's disparity is the initial guess for matching left against right about the images' centres
    asked = MatchGuess(left=apart / 2.0, right=-apart / 2.0, reach_px=REACH_PX)
    fine = match_fine(sighting, calibration, asked)
    gazes = gazes_under(calibration, sighting.volts)
    matched = fine.score >= FINE_SCORE
    if matched:
        apart = fine.residual_px / calibration.fovea_f_px
    place = Gazes(left=gazes.left + apart / 2.0, right=gazes.right - apart / 2.0)
    sigma_px = fine.sigma_x_px if matched else COARSE_SIGMA_PX
    return LoopErrors(
        values_rad=np.array([pan[0], pan[1], apart[0], apart[1] / 2.0]),
        point=triangulate(calibration, place, sigma_px=sigma_px),
        fine=matched,
    )
