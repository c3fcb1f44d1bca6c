import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_hardware.contract import MirrorVolts, Role, StereoVolts
from foveacam_pipeline.calibrate.drift.correction import turn_eye
from foveacam_pipeline.calibrate.drift.values import EyeTurn
from foveacam_pipeline.geometry import homography_apply
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.models.mirror import DAC_STEP_V
from foveacam_pipeline.stereo.rectify import plane_from_raw

F_PX = CALIBRATION.fovea_f_px
TURN = EyeTurn(turn_rad=(math.radians(0.25), math.radians(-0.2), math.radians(0.1)))
STRETCHED = EyeTurn(turn_rad=TURN.turn_rad, stretch=(1e-3, -5e-4, 2e-4))


def volts_over_the_field(count: int = 300) -> NDArray[np.float64]:
    return np.random.default_rng(3).uniform(-160.0, 160.0, (count, 2))


def test_a_turned_mirror_looks_where_the_turned_eye_does() -> None:
    volts = volts_over_the_field()
    turned = turn_eye(CALIBRATION.left, STRETCHED, f_px=F_PX).mirror
    expected = STRETCHED.apply(np.tan(CALIBRATION.left.mirror.angles_of(volts)))
    assert F_PX * float(np.abs(np.tan(turned.angles_of(volts)) - expected).max()) < 0.02


def test_no_turn_changes_nothing() -> None:
    volts = volts_over_the_field()
    still = turn_eye(CALIBRATION.left, EyeTurn(), f_px=F_PX).mirror
    assert np.allclose(still.angles_of(volts), CALIBRATION.left.mirror.angles_of(volts), atol=0.001 / F_PX)


def test_a_turned_mirror_still_closes_its_round_trip() -> None:
    mirror = turn_eye(CALIBRATION.right, STRETCHED, f_px=F_PX).mirror
    angles = mirror.angles_of(volts_over_the_field())
    angles = angles[mirror.inside(angles)]
    assert len(angles) > 200
    back = mirror.angles_of(mirror.volts_for(angles))
    assert float(np.abs(back - angles).max()) < 0.05 * DAC_STEP_V * math.radians(0.05)


@pytest.mark.parametrize("volts_v", [(0.0, 0.0), (120.0, -90.0), (-150.0, 140.0)])
def test_every_pixel_of_a_turned_eye_is_turned(volts_v: tuple[float, float]) -> None:
    raw_px = np.array([[0.0, 0.0], [1439.0, 0.0], [1439.0, 1079.0], [300.0, 800.0], [719.5, 539.5]])
    before, after = (rays_of(calibration, volts_v, raw_px) for calibration in (CALIBRATION, turned_rig()))
    assert F_PX * float(np.abs(after - TURN.apply(before)).max()) < 0.05


def turned_rig() -> Calibration:
    return replace(CALIBRATION, left=turn_eye(CALIBRATION.left, TURN, f_px=F_PX))


def rays_of(
    calibration: Calibration, volts_v: tuple[float, float], raw_px: NDArray[np.float64]
) -> NDArray[np.float64]:
    drive = MirrorVolts(x_v=volts_v[0], y_v=volts_v[1])
    plane = plane_from_raw(calibration, Role.LEFT, StereoVolts(left=drive, right=drive), depth_m=math.inf)
    return np.asarray(homography_apply(plane, raw_px) / F_PX)
