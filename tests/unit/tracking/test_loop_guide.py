"""The guide strip, its picture, the target guide and the loop, on a painted rig."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import PlaneHead, noise_texture, plain_texture

from foveacam_hardware.contract import Frame, OutOfRange, Role
from foveacam_pipeline.continuous_loop.guide_match import GuideMatch, match_guide
from foveacam_pipeline.continuous_loop.pictures import CAPTION_PX, GAP_PX, match_picture
from foveacam_pipeline.continuous_loop.settings import AXES, Axis, LoopSettings
from foveacam_pipeline.continuous_loop.target_guide import (
    LONGEST_LEAD_NS,
    LOST_MISSES,
    GuideState,
    TargetGuide,
)
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStatus, VergenceLoop
from foveacam_pipeline.verge.aim import aim_at, volts_for
from foveacam_pipeline.verge.distance import place_on_ray
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.values import DirectionTarget
from foveacam_server.resources.looking.loop.loop_run import LoopRun
from foveacam_server.resources.looking.loop.orders import FirstTarget, choose_target, configure

Z_M = 6.0
FIXED = LoopSettings(tracker=None)
TARGET = np.array([0.02, -0.03])


def painted(**options: object) -> PlaneHead:
    return PlaneHead(z_m=Z_M, texture=noise_texture(), **options)  # type: ignore[arg-type]  # options of the painted head


def matched(head: PlaneHead, *, pan: float = 0.0, shift: float = 0.0) -> GuideMatch:
    """Return the match of a look beside `TARGET`, tangents; `shift`: left lower and right higher."""
    gazes = aim_at(head.calibration, TARGET + np.array([pan, 0.0]), 1.0 / Z_M)
    lowered = gazes.moved(np.array([0.0, shift]), np.array([0.0, -shift]))
    sighting = head.look(volts_for(head.calibration, lowered))
    return match_guide(sighting, head.calibration, TARGET, FIXED, lower_rad=2.0 * shift)


@pytest.mark.parametrize(("pan", "shift"), [(0.0, 0.0), (0.008, 0.0), (-0.008, 0.006)])
def test_the_strip_tells_where_each_fovea_looks(pan: float, shift: float) -> None:
    head = painted()
    match = matched(head, pan=pan, shift=shift)
    tolerance = 0.003 / Z_M  # the pupils walk by up to 3 mm beside the pivots
    np.testing.assert_allclose(match.left.tangents, TARGET + np.array([pan, shift]), atol=tolerance)
    np.testing.assert_allclose(match.right.tangents, TARGET + np.array([pan, -shift]), atol=tolerance)
    assert match.score > 0.4


def test_a_blank_wall_has_a_low_score() -> None:
    head = PlaneHead(z_m=Z_M, texture=plain_texture())
    assert matched(head).score < FIXED.min_score


def test_in_the_picture_a_map_s_best_place_is_below_the_middle_of_its_eye_s_box() -> None:
    match = matched(painted(), pan=0.008)
    picture = match_picture(match)
    height, width = match.strip.shape
    rows = match.left.scores.shape[0]
    assert picture.shape == (height + 2 * rows + 3 * CAPTION_PX + 2 * GAP_PX, width, 3)
    for eye in (match.left, match.right):
        x_px, y_px = eye.middle_px
        best_y, best_x = np.unravel_index(int(np.argmax(eye.scores)), eye.scores.shape)
        assert best_x + (eye.size_px[0] - 1) / 2 == pytest.approx(x_px, abs=1.0)
        assert best_y + (eye.size_px[1] - 1) / 2 == pytest.approx(y_px, abs=1.0)


def test_a_place_that_was_chosen_stays_where_it_is() -> None:
    head = painted()
    guide = guide_of(head, head.wide(), FIXED)
    guide.see_wide(head.wide())
    assert guide.state is GuideState.FIXED
    np.testing.assert_array_equal(guide.place(10**10, predict=True), TARGET)


def guide_of(head: PlaneHead, frame: Frame, settings: LoopSettings) -> TargetGuide:
    return TargetGuide(
        frame, TARGET, calibration=head.calibration, settings=settings, inverse_z_per_m=1.0 / Z_M
    )


def watch(head: PlaneHead, guide: TargetGuide, frames: int) -> None:
    for _ in range(frames):
        head.clock.sleep_until_ns(head.clock.now_ns() + 50_000_000)
        guide.see_wide(head.wide())


def test_what_moves_is_led_to_where_it_will_be() -> None:
    head = painted(shift_m=lambda t_ns: (0.4 * t_ns / 1e9, 0.0))
    guide = guide_of(head, head.wide(), LoopSettings())
    watch(head, guide, 12)
    ahead_ns = head.clock.now_ns() + 100_000_000
    assert guide.state is GuideState.TRACKED
    truth = TARGET[0] + 0.4 * ahead_ns / 1e9 / Z_M
    seen = TARGET[0] + 0.4 * head.clock.now_ns() / 1e9 / Z_M
    assert guide.place(ahead_ns, predict=True)[0] == pytest.approx(truth, abs=1e-3)
    assert guide.place(ahead_ns, predict=False)[0] == pytest.approx(seen, abs=1e-3)


def test_what_is_not_seen_any_more_is_led_no_farther_than_half_a_second() -> None:
    head = painted(shift_m=lambda t_ns: (0.4 * t_ns / 1e9, 0.0))
    guide = guide_of(head, head.wide(), LoopSettings())
    watch(head, guide, 12)
    seen_ns = head.clock.now_ns()
    last = guide.place(seen_ns + LONGEST_LEAD_NS, predict=True)
    assert last[0] - guide.place(seen_ns, predict=True)[0] == pytest.approx(0.2 / Z_M, rel=0.2)
    np.testing.assert_array_equal(guide.place(seen_ns + 10 * LONGEST_LEAD_NS, predict=True), last)


def test_what_is_hidden_is_lost_after_ten_frames_and_found_again() -> None:
    head = PlaneHead(z_m=1.7, texture=noise_texture())  # nearer than where the texture repeats in the view
    curtain = PlaneHead(z_m=1.7, texture=plain_texture(), clock=head.clock)
    guide = guide_of(head, head.wide(), LoopSettings())
    watch(head, guide, 2)
    watch(curtain, guide, LOST_MISSES)
    assert guide.state is GuideState.LOST
    assert guide.score is None
    watch(head, guide, 3)
    assert (guide.state, guide.score is None) == (GuideState.TRACKED, False)
    np.testing.assert_allclose(guide.place(head.clock.now_ns(), predict=True), TARGET, atol=2e-3)


def test_a_blank_wall_cannot_be_tracked() -> None:
    head = PlaneHead(z_m=Z_M, texture=plain_texture(), noise=0.0)
    with pytest.raises(OutOfRange, match="nothing that could be followed"):
        guide_of(head, head.wide(), LoopSettings())


def test_depth_that_a_look_measured_moves_no_direction() -> None:
    head = painted()
    guide = guide_of(head, head.wide(), LoopSettings())
    watch(head, guide, 2)
    before = guide.place(head.clock.now_ns(), predict=True)
    guide.see_point(head.clock.now_ns(), place_on_ray(TARGET, 1.0 / Z_M, 1e-4))
    np.testing.assert_allclose(guide.place(head.clock.now_ns(), predict=True), before, atol=1e-6)


# The loop ------------------------------------------------------------------------------------------------


def begun(
    head: PlaneHead, settings: LoopSettings = FIXED, *, inverse_z_per_m: float = 1.1 / Z_M
) -> VergenceLoop:
    loop = VergenceLoop(head.calibration, clock=head.clock, settings=settings)
    loop.choose(head.wide(), TARGET, inverse_z_per_m=inverse_z_per_m)
    return loop


def test_the_loop_verges_on_the_plane_though_an_eye_is_knocked() -> None:
    head = painted(knocked_rad={Role.LEFT: (0.004, 0.003)})
    loop = begun(head)
    steps = [loop.step(head) for _ in range(15)]
    errors = steps[-1].errors
    assert steps[-1].status is LoopStatus.TRACKING
    assert errors is not None
    assert float(np.abs(errors.values_rad).max()) < math.radians(0.02)
    command = dict(zip(AXES, loop.command_rad.tolist(), strict=True))
    assert command[Axis.SHIFT_Y] == pytest.approx(-0.0015, abs=2e-4)  # half of 3 mrad, the other way


def beyond_reach(head: PlaneHead) -> NDArray[np.float64]:
    """Return a target in the wide view that the mirrors do not reach."""
    wide = head.calibration.wide
    return np.asarray(np.tan(wide.angles_rad([[wide.width - 120.0, 540.0]])[0]), dtype=np.float64)


def test_commands_do_not_run_away_while_the_target_is_out_of_reach() -> None:
    head = painted()
    loop = VergenceLoop(head.calibration, clock=head.clock, settings=FIXED)
    loop.choose(head.wide(), beyond_reach(head), inverse_z_per_m=1.0 / Z_M)
    first = loop.step(head)
    assert first.status is LoopStatus.OUT_OF_REACH
    for _ in range(8):
        loop.step(head)
    assert abs(math.degrees(float(loop.command_rad[0]))) < 0.1


def test_the_eyes_are_aimed_at_where_a_moving_target_is_when_it_is_exposed() -> None:
    head = painted(shift_m=lambda t_ns: (0.4 * t_ns / 1e9, 0.0))
    loop = begun(head, LoopSettings())
    step = [loop.step(head) for _ in range(15)][-1]
    assert step.sighting is not None
    exposed_ns = step.sighting.left.t_ns
    assert exposed_ns - step.t_ns == 0 and loop.lead_ms == pytest.approx(head.look_ns / 1e6)
    truth = TARGET[0] + 0.4 * exposed_ns / 1e9 / Z_M
    assert step.target[0] == pytest.approx(truth, abs=0.3 * 0.4 * head.look_ns / 1e9 / Z_M)


# A loop of the server ---------------------------------------------------------------------------------------


class Nothing:
    """Knows no depth."""

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        return DepthSamples.none()


def test_a_target_whose_range_is_known_is_begun_at_its_depth() -> None:
    head, aside = painted(), np.array([0.17, -0.16])
    loop = VergenceLoop(head.calibration, clock=head.clock, settings=FIXED)
    run = LoopRun(loop, hardware=None, clock=head.clock, on_step=lambda _: None)  # type: ignore[arg-type]  # none is held
    wanted = FirstTarget(
        target=DirectionTarget(ax_rad=math.atan(aside[0]), ay_rad=math.atan(aside[1])),
        place=aside,
        clicked=None,
        distance_m=Z_M * math.hypot(1.0, *aside),
    )
    choose_target(run, head, wanted, calibration=head.calibration, clock=head.clock, context=Nothing())

    verge_rad = loop.command_rad[AXES.index(Axis.VERGE)]
    assert verge_rad == pytest.approx(head.calibration.baseline_m / Z_M)


def test_a_tracker_that_finds_nothing_to_learn_leaves_the_settings_as_they_were() -> None:
    head = PlaneHead(z_m=Z_M, texture=plain_texture())
    loop = VergenceLoop(head.calibration, clock=head.clock, settings=FIXED)
    loop.choose(head.wide(), TARGET, inverse_z_per_m=1.0 / Z_M)
    with pytest.raises(OutOfRange):
        configure(loop, LoopSettings(), head)

    assert loop.settings == FIXED
