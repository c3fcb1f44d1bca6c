"""What a look says of the four errors that the loop corrects, and where the target is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Sighting
from foveacam_pipeline.loop.guide_match import GuideMatch
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.aim import Gazes, gazes_under
from foveacam_pipeline.verge.distance import LocatedPoint, triangulate
from foveacam_pipeline.verge.matching.fine import MatchGuess, match_fine

FINE_SCORE = 0.7
REACH_PX = (60, 24)
"""How far the strip may misplace one fovea against the other, fovea px."""
COARSE_SIGMA_PX = 6.0
"""Error of the disparity that the strip tells, fovea px: a fifth of a wide px in each eye."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoopErrors:
    """What the commands should change by: (4,) rad in the order of `AXES`; the point that is looked at.

    `fine`: left was matched against right in the foveae themselves; else the strip alone tells.
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
    # the middle of both pictures shows what lies on both sides of the point; ask the foveae there
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
