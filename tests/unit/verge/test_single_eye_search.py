"""What one look shows of a target at a depth, and how many looks a fixation has."""

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_pipeline.verge.aim import aim_at
from foveacam_pipeline.verge.closed_loop import ClosedLoop
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded, FixationHead, StepResult
from foveacam_pipeline.verge.resolved_target import resolve
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.single_eye.search import SingleEyeSearch
from foveacam_pipeline.verge.values import FixationState, PixelTarget, VergePhase

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


def test_looks_are_granted_beyond_those_already_made() -> None:
    head = PlaneHead(z_m=Z_M, texture=noise_texture())
    limits = VergeSettings(max_looks=3)
    fixation_head = FixationHead(
        head, CALIBRATION, clock=head.clock, limits=limits, on_step=None, cancelled=None
    )

    def looks_left() -> int:
        for made in range(10):
            try:
                observation = fixation_head.look(aim_at(CALIBRATION, np.zeros(2), 0.2), VergePhase.FINE)
            except FixationEnded as ended:
                assert ended.state is FixationState.TIMED_OUT
                return made
            fixation_head.record(observation, StepResult(score=0.0))
        return 10

    assert looks_left() == 3
    fixation_head.grant(looks=4, seconds=2.0)
    assert looks_left() == 4
