"""What one look shows of a target at a depth."""

import pytest
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_pipeline.verge.closed_loop import ClosedLoop
from foveacam_pipeline.verge.looking.fixation_head import FixationHead
from foveacam_pipeline.verge.resolved_target import resolve
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.single_eye.search import SingleEyeSearch
from foveacam_pipeline.verge.values import PixelTarget

LIMITS = VergeSettings()
Z_M = 4.0


@pytest.mark.parametrize(
    ("depth_m", "shown"), [(Z_M, True), (1.01 * Z_M, True), (0.8 * Z_M, False), (8.0, False)]
)
def test_a_look_shows_a_target_at_its_own_depth_alone(depth_m: float, shown: bool) -> None:
    head = PlaneHead(z_m=Z_M, texture=noise_texture())
    fixation_head = FixationHead(
        head, CALIBRATION, clock=head.clock, limits=LIMITS, on_step=None, cancelled=None
    )
    loop = ClosedLoop(fixation_head, CALIBRATION, LIMITS)
    aim = resolve(PixelTarget(x_px=850.3, y_px=420.7), CALIBRATION.wide, LIMITS)
    loop.run(aim)
    assert fixation_head.last is not None

    score = SingleEyeSearch(fixation_head, CALIBRATION, LIMITS).best_score(
        fixation_head.last, loop.templates, aim.tangents, 1.0 / depth_m
    )

    assert (score > 0.9) if shown else (score < 0.5)
