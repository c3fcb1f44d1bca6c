"""The vergence loop on a plane that faces the rig: how it ends, what it says, what it costs."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import (
    CALIBRATION,
    MEASURED,
    TILE,
    PlaneHead,
    noise_texture,
    plain_texture,
)

from foveacam_hardware.contract import Cancelled, InvalidInput, OutOfRange, Role
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.estimate import DistanceEstimate
from foveacam_pipeline.verge.fixate import PriorKnowledge, fixate
from foveacam_pipeline.verge.resolved_target import patches_for, resolve
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.values import (
    Basis,
    DirectionTarget,
    Fixation,
    FixationState,
    PixelTarget,
    RectangleTarget,
    Target,
    VergePhase,
    VergeStep,
)

pytestmark = pytest.mark.slow

NOISE = noise_texture()
CLICK = PixelTarget(x_px=850.3, y_px=420.7)
with_either = pytest.mark.parametrize("calibration", [CALIBRATION, MEASURED], ids=["fixed", "measured"])


def fix(head: PlaneHead, target: Target = CLICK, limits: VergeSettings | None = None) -> Fixation:
    return fixate(head, head.calibration, target, clock=head.clock, limits=limits or VergeSettings())


def true_distance_m(fixation: Fixation, z_m: float) -> float:
    return z_m * math.hypot(1.0, math.tan(fixation.target_ax_rad), math.tan(fixation.target_ay_rad))


def _least_turn_px(fixation: Fixation) -> float:
    """Return how far the eyes turned at least from look to look, fovea px: less would show the same."""
    gazes = np.array([[s.left_ax_rad, s.left_ay_rad, s.right_ax_rad, s.right_ay_rad] for s in fixation.steps])
    return CALIBRATION.fovea_f_px * float(np.abs(np.diff(gazes, axis=0)).max(axis=1).min())


@pytest.mark.parametrize("z_m", [1.6, 2.4, 5.0, 10.0, 28.0])
def test_a_textured_click_verges_at_its_distance(z_m: float) -> None:
    fixation = fix(PlaneHead(z_m=z_m, texture=NOISE))
    assert fixation.state is FixationState.VERGED, fixation.reason
    assert fixation.distance_m is not None and fixation.distance_sigma_m is not None
    assert fixation.residual_px is not None and fixation.residual_px <= 0.71  # 0.5 px along each axis
    assert len(fixation.steps) <= 6
    assert abs(fixation.distance_m - true_distance_m(fixation, z_m)) <= 3.0 * fixation.distance_sigma_m


def test_the_point_lies_on_the_ray_of_the_click() -> None:
    fixation = fix(PlaneHead(z_m=7.0, texture=NOISE))
    assert fixation.point_rig_m is not None
    x_m, y_m, z_m = fixation.point_rig_m
    wide_px = CALIBRATION.wide.pixels([[math.atan2(x_m, z_m), math.atan2(y_m, z_m)]])[0]
    np.testing.assert_allclose(wide_px, [CLICK.x_px, CLICK.y_px], atol=1.0)  # centred to one wide px


def test_both_eyes_first_look_parallel_to_the_central_ray() -> None:
    first = fix(PlaneHead(z_m=6.0, texture=NOISE)).steps[0]
    ax_rad, ay_rad = CALIBRATION.wide.angles_rad([[CLICK.x_px, CLICK.y_px]])[0].tolist()
    assert first.phase is VergePhase.PARALLEL
    gazes = [first.left_ax_rad, first.right_ax_rad, first.left_ay_rad, first.right_ay_rad]
    np.testing.assert_allclose(gazes, [ax_rad, ax_rad, ay_rad, ay_rad], atol=1e-6)


def test_near_targets_are_found_farther_along_the_epipolar_line() -> None:
    phases = [step.phase for step in fix(PlaneHead(z_m=1.6, texture=NOISE)).steps]
    assert phases[:2] == [VergePhase.PARALLEL, VergePhase.EPIPOLAR]
    assert phases.count(VergePhase.EPIPOLAR) <= 2


def test_click_rectangle_and_direction_of_one_point_agree() -> None:
    ax_rad, ay_rad = CALIBRATION.wide.angles_rad([[CLICK.x_px, CLICK.y_px]])[0].tolist()
    corner_x_px, corner_y_px = CLICK.x_px - 29.5, CLICK.y_px - 19.5
    targets: list[Target] = [
        CLICK,
        RectangleTarget(x_px=corner_x_px, y_px=corner_y_px, width_px=60.0, height_px=40.0),
        DirectionTarget(ax_rad=ax_rad, ay_rad=ay_rad),
    ]
    found = [fix(PlaneHead(z_m=8.0, texture=NOISE), target) for target in targets]
    distances_m = [fixation.distance_m for fixation in found]
    sigma_m = found[0].distance_sigma_m
    assert sigma_m is not None and None not in distances_m, [fixation.reason for fixation in found]
    np.testing.assert_allclose(
        np.array(distances_m, dtype=float), true_distance_m(found[0], 8.0), atol=3 * sigma_m
    )


@pytest.mark.parametrize(("strength", "grows"), [(0.3, False), (0.07, True)])
def test_a_patch_grows_until_it_holds_enough_texture(strength: float, grows: bool) -> None:
    faint = (128.0 + strength * (NOISE - 128.0)).astype(np.float32)
    limits, wide = VergeSettings(), CALIBRATION.wide
    image = gray(to_uint8(PlaneHead(z_m=6.0, texture=faint).wide()))
    best = patches_for(image, resolve(CLICK, wide, limits), wide, limits)[0]
    assert best.sigma_px < limits.template_texture_sigma_px
    assert (best.half_px[0] > limits.template_half_px) is grows


def test_a_plain_surface_without_any_border_has_only_a_bound() -> None:
    head = PlaneHead(z_m=6.0, texture=plain_texture())
    fixation = fix(head)
    assert fixation.state is FixationState.NO_TEXTURE
    assert "no texture" in fixation.reason
    assert fixation.basis is Basis.BOUND
    assert (fixation.distance_m, fixation.point_rig_m) == (None, None)
    assert fixation.bound is not None
    assert fixation.bound.nearest_m < 6.0 < fixation.bound.farthest_m
    assert head.looks <= 2


def test_lines_along_the_rows_tell_no_distance() -> None:
    rows = NOISE.mean(axis=1, keepdims=True)
    lines = 128.0 + np.repeat(4.0 * (rows - rows.mean()), TILE, axis=1)
    fixation = fix(PlaneHead(z_m=6.0, texture=lines.astype(np.float32)))
    assert fixation.state is not FixationState.VERGED
    assert fixation.distance_m is None


@with_either
def test_lines_across_the_rows_tell_the_distance(calibration: Calibration) -> None:
    columns = NOISE.mean(axis=0, keepdims=True)
    lines = 128.0 + np.repeat(4.0 * (columns - columns.mean()), TILE, axis=0)
    fixation = fix(PlaneHead(z_m=6.0, texture=lines.astype(np.float32), calibration=calibration))
    assert fixation.state is FixationState.VERGED, fixation.reason
    assert fixation.distance_m == pytest.approx(true_distance_m(fixation, 6.0), rel=0.005)


@pytest.mark.parametrize(  # 7 and 13 wide px at 6 m
    ("period_texels", "calibration"), [(32, CALIBRATION), (64, MEASURED)], ids=["fixed", "measured"]
)
def test_a_pattern_that_repeats_is_not_taken_for_another_distance(
    period_texels: int, calibration: Calibration
) -> None:
    wave = 40.0 * np.sin(2.0 * np.pi * np.arange(TILE) / period_texels)
    grid = (128.0 + wave[None, :] + wave[:, None]).astype(np.float32)
    fixation = fix(PlaneHead(z_m=6.0, texture=grid, calibration=calibration))
    assert fixation.state is FixationState.LOST, fixation.reason
    assert "repeats" in fixation.reason


def test_a_pattern_that_changes_too_slowly_tells_no_distance() -> None:
    wave = 40.0 * np.sin(2.0 * np.pi * np.arange(TILE) / 128)  # 245 fovea px at 6 m
    grid = (128.0 + wave[None, :] + wave[:, None]).astype(np.float32)
    fixation = fix(PlaneHead(z_m=6.0, texture=grid, calibration=MEASURED))
    assert fixation.state is FixationState.NO_TEXTURE, fixation.reason
    assert "does not determine a distance" in fixation.reason
    assert _least_turn_px(fixation) > 2.0


@pytest.mark.parametrize(("eye", "calibration"), [(Role.LEFT, CALIBRATION), (Role.RIGHT, MEASURED)])
def test_a_target_hidden_from_one_eye_is_measured_by_the_other_and_the_wide_camera(
    eye: Role, calibration: Calibration
) -> None:
    head = PlaneHead(z_m=6.0, texture=NOISE, blind=frozenset({eye}), calibration=calibration)
    fixation = fix(head)
    assert fixation.state is FixationState.LOST
    assert fixation.basis is Basis.FOVEA_AND_WIDE, fixation.reason
    assert fixation.distance_m is not None and fixation.distance_sigma_m is not None
    assert abs(fixation.distance_m - true_distance_m(fixation, 6.0)) <= 3.0 * fixation.distance_sigma_m
    views = {Role.LEFT: fixation.left_view, Role.RIGHT: fixation.right_view}
    assert [role for role, view in views.items() if view is not None and not view.sees_target] == [eye]
    assert fixation.target_offset is None
    assert head.clock.now_ns() < 1_000_000_000  # nothing moves: nobody is waited for
    assert _least_turn_px(fixation) > 1.0


KNOCKS_DEG: list[tuple[tuple[float, float], tuple[float, float]]] = [
    ((0.0, 0.1), (0.0, -0.1)),
    ((0.2, 0.0), (0.2, 0.0)),
    ((-0.2, 0.3), (-0.1, 0.2)),
]


@pytest.mark.parametrize(("left_deg", "right_deg"), KNOCKS_DEG, ids=["height", "across", "any"])
def test_eyes_that_were_knocked_aside_are_told_from_a_target_that_is_not_there(
    left_deg: tuple[float, float], right_deg: tuple[float, float]
) -> None:
    left, right = np.radians(left_deg), np.radians(right_deg)
    knocked = {Role.LEFT: tuple(left.tolist()), Role.RIGHT: tuple(right.tolist())}
    fixation = fix(PlaneHead(z_m=8.0, texture=NOISE, knocked_rad=knocked))
    assert fixation.state is FixationState.LOST
    assert "mounts may have moved: measure the drift" in fixation.reason
    assert fixation.target_offset is not None
    # An eye that looks to the right of where it is thought to look shows everything farther left
    across_px, down_px = -CALIBRATION.fovea_f_px * (left + right) / 2.0
    assert fixation.target_offset.across_px == pytest.approx(across_px, abs=3.0)
    assert fixation.target_offset.down_px == pytest.approx(down_px, abs=3.0)
    rows_px = -CALIBRATION.fovea_f_px * float(right[1] - left[1])
    assert fixation.target_offset.rows_px == pytest.approx(rows_px, abs=3.0)


def test_a_target_is_looked_for_again_when_somebody_has_passed() -> None:
    def walks(t_ns: int) -> float | None:
        return CLICK.x_px - 150.0 + 220e-9 * t_ns if t_ns < 800_000_000 else None

    head = PlaneHead(z_m=6.0, texture=NOISE, passer_px=walks)
    fixation = fix(head)
    assert fixation.state is FixationState.VERGED, fixation.reason
    assert fixation.distance_m == pytest.approx(true_distance_m(fixation, 6.0), rel=0.005)
    assert 800.0 < fixation.duration_ms < 1800.0


PASSED_NS = 900_000_000
"""When somebody has passed by whom a track was led astray."""


def _carried(speed_m_s: float) -> Callable[[int], tuple[float, float]]:
    """Return how far something that looks like the target is carried along, m, until it is gone."""
    return lambda t_ns: (speed_m_s * t_ns / 1e9 if t_ns < PASSED_NS else 0.0, 0.0)


@pytest.mark.parametrize("speed_m_s", [0.15, 0.5])
def test_a_target_is_looked_for_where_it_was_clicked_when_a_passer_by_was_taken_for_it(
    speed_m_s: float,
) -> None:
    def walks(t_ns: int) -> float | None:
        return CLICK.x_px + 120.0 if t_ns < PASSED_NS else None

    fixation = fix(PlaneHead(z_m=6.0, texture=NOISE, shift_m=_carried(speed_m_s), passer_px=walks))
    assert fixation.state is FixationState.VERGED, fixation.reason
    assert fixation.distance_m == pytest.approx(true_distance_m(fixation, 6.0), rel=0.005)


def test_the_eyes_end_where_a_target_was_clicked_that_is_gone() -> None:
    def runs_away(t_ns: int) -> tuple[float, float]:
        return _carried(0.3)(t_ns) if t_ns < PASSED_NS else (9.0, 0.0)

    both_blind = frozenset({Role.LEFT, Role.RIGHT})
    fixation = fix(PlaneHead(z_m=6.0, texture=NOISE, shift_m=runs_away, blind=both_blind))
    assert fixation.basis is Basis.BOUND, fixation.reason
    last = fixation.steps[-1]
    aside_rad = (last.left_ax_rad + last.right_ax_rad) / 2.0 - fixation.target_ax_rad
    assert abs(aside_rad) < 5e-3  # its track leads 0.05 rad a second away


def test_somebody_who_stays_in_the_way_is_not_waited_for_for_ever() -> None:
    head = PlaneHead(z_m=6.0, texture=NOISE, passer_px=lambda t_ns: CLICK.x_px - 80.0 + 40.0 * math.sin(t_ns))
    fixation = fix(head)
    assert fixation.state is FixationState.LOST
    assert fixation.duration_ms < 4000.0


def test_a_moving_target_is_followed() -> None:
    def walk(t_ns: int) -> tuple[float, float]:
        return 0.6e-9 * t_ns, 0.0  # 0.6 m/s

    fixation = fix(PlaneHead(z_m=10.0, texture=NOISE, shift_m=walk))
    assert fixation.state is FixationState.VERGED, fixation.reason
    assert fixation.distance_m == pytest.approx(true_distance_m(fixation, 10.0), rel=0.01)
    last = fixation.steps[-1]
    moved_rad = (last.left_ax_rad + last.right_ax_rad) / 2.0 - fixation.target_ax_rad
    elapsed_s = fixation.duration_ms / 1e3
    assert moved_rad == pytest.approx(0.06 * elapsed_s, abs=2e-3)  # 0.6 m/s at 10 m, five wide px


def test_a_target_that_moves_away_while_it_is_looked_for_has_no_distance() -> None:
    def jump(t_ns: int) -> tuple[float, float]:
        return (5.0, 0.0) if t_ns > 50_000_000 else (0.0, 0.0)  # to a part of the plane that looks otherwise

    both_blind = frozenset({Role.LEFT, Role.RIGHT})  # what the eyes show is nothing of the wide view
    fixation = fix(PlaneHead(z_m=6.0, texture=NOISE, shift_m=jump, blind=both_blind))
    assert fixation.basis is Basis.BOUND, fixation.reason
    assert fixation.distance_m is None
    assert "moved away" in fixation.reason


@dataclass(frozen=True)
class Known:
    """A context that knows one depth in every direction."""

    inverse_z_per_m: float

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        return DepthSamples(
            tangents=target[None],
            inverse_z_per_m=np.array([self.inverse_z_per_m]),
            sigma_per_m=np.array([min(reach_tan, 1e-3)]),
        )


def test_where_the_depth_is_known_the_first_look_verges_on_it() -> None:
    head = PlaneHead(z_m=1.6, texture=NOISE)
    known = PriorKnowledge(context=Known(inverse_z_per_m=1.0 / 1.61))
    fixation = fixate(head, head.calibration, CLICK, clock=head.clock, known=known)
    assert fixation.state is FixationState.VERGED, fixation.reason
    assert len(fixation.steps) <= 2  # found at once, then centred
    assert len(fixation.steps) < len(fix(PlaneHead(z_m=1.6, texture=NOISE)).steps)


def test_what_is_known_wrongly_misleads_nobody() -> None:
    head = PlaneHead(z_m=5.0, texture=NOISE)
    known = PriorKnowledge(context=Known(inverse_z_per_m=1.0 / 2.0))
    fixation = fixate(head, head.calibration, CLICK, clock=head.clock, known=known)
    assert fixation.distance_m is not None and fixation.distance_sigma_m is not None
    assert abs(fixation.distance_m - true_distance_m(fixation, 5.0)) <= 3.0 * fixation.distance_sigma_m


def test_a_direction_that_no_eye_can_reach_is_refused_before_anything_moves() -> None:
    head = PlaneHead(z_m=6.0, texture=NOISE)
    fixation = fix(head, DirectionTarget(ax_rad=0.0, ay_rad=math.radians(9.0)))
    assert fixation.state is FixationState.OUT_OF_RANGE
    assert "eye cannot look there" in fixation.reason and "calibrated field" in fixation.reason
    assert fixation.basis is None
    assert head.looks == 0


def test_a_direction_outside_the_wide_view_says_so() -> None:
    fixation = fix(PlaneHead(z_m=6.0, texture=NOISE), DirectionTarget(ax_rad=0.0, ay_rad=math.radians(9.9)))
    assert fixation.state is FixationState.OUT_OF_RANGE
    assert "wide view" in fixation.reason


@pytest.mark.parametrize("x_px", [-3.0, 1600.0, math.nan])
def test_a_pixel_outside_the_image_is_an_error(x_px: float) -> None:
    with pytest.raises(OutOfRange, match="outside the image"):
        fix(PlaneHead(z_m=6.0, texture=NOISE), PixelTarget(x_px=x_px, y_px=500.0))


def test_a_rectangle_that_is_no_number_is_an_error() -> None:
    target = RectangleTarget(x_px=math.nan, y_px=1.0, width_px=30.0, height_px=30.0)
    with pytest.raises(InvalidInput, match="finite"):
        fix(PlaneHead(z_m=6.0, texture=NOISE), target)


def test_it_gives_up_at_its_deadline() -> None:
    head = PlaneHead(z_m=1.6, texture=NOISE, look_ns=4_000_000_000)
    fixation = fix(head, limits=VergeSettings(timeout_s=5.0))
    assert fixation.state is FixationState.TIMED_OUT
    assert fixation.duration_ms <= 30_000.0  # two looks of the loop, and two of each stage that follows


def test_it_stops_when_it_is_cancelled() -> None:
    head = PlaneHead(z_m=1.6, texture=NOISE)
    with pytest.raises(Cancelled, match="after 1 looks"):
        fixate(head, CALIBRATION, CLICK, clock=head.clock, cancelled=lambda: head.looks >= 1)


def test_every_step_is_reported_as_it_is_made() -> None:
    head = PlaneHead(z_m=4.0, texture=NOISE)
    seen: list[VergeStep] = []
    fixation = fixate(head, CALIBRATION, CLICK, clock=head.clock, on_step=seen.append)
    assert tuple(seen) == fixation.steps
    assert [step.index for step in seen] == list(range(head.looks))
    assert all(step.compute_ms > 0.0 for step in seen)
    assert fixation.sighting is not None and fixation.volts == fixation.sighting.volts


def test_what_a_look_tells_of_the_distance_is_reported_once_a_look_before_the_answer() -> None:
    head = PlaneHead(z_m=4.0, texture=NOISE)
    told: list[DistanceEstimate] = []
    fixation = fixate(head, CALIBRATION, CLICK, clock=head.clock, on_estimate=told.append)
    looks = [estimate.looks for estimate in told]
    assert looks and looks == sorted(set(looks)) and looks[-1] < len(fixation.steps)
    for estimate in told:
        assert estimate.basis is Basis.BOTH_FOVEAE
        error_m = abs(estimate.point.distance_m - true_distance_m(fixation, 4.0))
        assert error_m <= 5.0 * estimate.point.distance_sigma_m


def test_noise_in_the_pictures_is_paid_for_in_the_stated_error() -> None:
    quiet = fix(PlaneHead(z_m=10.0, texture=NOISE, noise=0.5))
    faint = (128.0 + 0.06 * (NOISE - 128.0)).astype(np.float32)
    noisy = fix(PlaneHead(z_m=10.0, texture=faint, noise=2.0))
    assert quiet.distance_sigma_m is not None
    if noisy.distance_sigma_m is not None:  # else it said that it cannot tell, which is as honest
        assert noisy.distance_sigma_m > quiet.distance_sigma_m
    else:
        assert noisy.state in {FixationState.NO_TEXTURE, FixationState.LOST}
