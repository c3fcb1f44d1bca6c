"""The wide view where both foveae look, enlarged to their scale: what the wide camera alone would tell."""

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.aim import gazes_under
from foveacam_pipeline.verge.matching.wide_patch import wide_window


def wide_zoom(
    frame: Frame, calibration: Calibration, volts: StereoVolts, *, scale: float = 0.5
) -> NDArray[np.uint8]:
    """Return the wide frame about the point on which the foveae meet, (h, w[, 3]) uint8, odd sides.

    `scale`: of the foveae's own. Where the gazes do not meet, the middle between them is shown.
    """
    meeting = calibration.meeting(volts)
    if meeting.in_front:
        target = meeting.point_m[:2] / meeting.point_m[2]
    else:
        gazes = gazes_under(calibration, volts)
        target = (gazes.left + gazes.right) / 2.0
    half = (round(scale * calibration.fovea_width / 2), round(scale * calibration.fovea_height / 2))
    view = wide_window(
        to_uint8(frame), calibration.wide, target, f_px=scale * calibration.fovea_f_px, half=half
    )
    return np.clip(np.rint(view), 0, 255).astype(np.uint8)
