"""How a target that is to be followed is found, from the click to both foveae."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.support.scenes.plane_head import PlaneHead, noise_texture

from foveacam_hardware.contract import OutOfRange
from foveacam_pipeline.track.acquire import ClickTrack, acquire
from foveacam_pipeline.track.image_tracker import TrackBox
from foveacam_pipeline.track.position_filter import PositionEstimate
from foveacam_pipeline.track.target import FADING_S
from foveacam_pipeline.verge.values import DirectionTarget, PixelTarget, RectangleTarget
from foveacam_server.resources.looking.follows.first_look import (
    MOVES_PX_S,
    catch_up,
    look_first,
    middle_px,
    moved_to,
    refresh,
    sides_px,
    track_click,
)
from foveacam_server.resources.looking.follows.followed import position_at
from foveacam_server.rig.live_views import RecentFrames

Z_M = 6.0
FRAME_NS = 66_000_000


class Nothing:
    """Knows no depth."""

    def around(self, target: object, *, reach_tan: float) -> tuple[()]:
        return ()


def walking_at(speed_m_s: float) -> Callable[[int], tuple[float, float]]:
    return lambda t_ns: (-0.3 + speed_m_s * t_ns / 1e9, 0.0)


def head_with(shift_m: Callable[[int], tuple[float, float]]) -> PlaneHead:
    return PlaneHead(z_m=Z_M, texture=noise_texture(), shift_m=shift_m, look_ns=FRAME_NS, binning=2)


def pixel_of(head: PlaneHead, t_ns: int) -> tuple[float, float]:
    """Return where the wide view shows what was at the plane's middle, px."""
    x_m, y_m = head.shift_m(t_ns)
    x_px, y_px = head.calibration.wide.pixels([np.arctan([x_m / Z_M, y_m / Z_M])])[0].tolist()
    return x_px, y_px


def clicked(head: PlaneHead) -> ClickTrack:
    frame = head.wide()
    x_px, y_px = pixel_of(head, frame.t_ns)
    return ClickTrack(frame, TrackBox(x_px=x_px, y_px=y_px))


def pass_frames(head: PlaneHead, click: ClickTrack, count: int) -> None:
    for _ in range(count):
        head.clock.sleep_until_ns(head.clock.now_ns() + FRAME_NS)
        click.see(head.wide())


def test_a_click_is_followed_to_the_newest_frame_with_its_speed() -> None:
    head = head_with(walking_at(1.0))
    click = clicked(head)
    pass_frames(head, click, 8)
    assert click.frame.t_ns == head.clock.now_ns()
    assert click.place_px == pytest.approx(pixel_of(head, head.clock.now_ns()), abs=1.0)
    assert click.speed_px_s[0] == pytest.approx(head.calibration.wide.fx_px / Z_M, rel=0.1)
    before = click.place_px
    click.see(head.wide())  # the same moment again
    assert click.place_px == before


def test_a_click_without_a_pictures_number_is_followed_from_the_newest_picture() -> None:
    head, recent = head_with(walking_at(1.0)), RecentFrames()
    x_px, y_px = pixel_of(head, head.clock.now_ns())
    target = PixelTarget(x_px=x_px, y_px=y_px)
    assert track_click(recent, target, frame_seq=None, box_px=64, now_ns=head.clock.now_ns()) is None
    recent.add(head.wide())
    click = track_click(recent, target, frame_seq=None, box_px=64, now_ns=head.clock.now_ns())
    assert click is not None
    head.clock.sleep_until_ns(head.clock.now_ns() + FRAME_NS)
    recent.add(head.wide())
    assert catch_up(recent, click).place_px == pytest.approx(pixel_of(head, head.clock.now_ns()), abs=1.0)


def test_what_moves_is_acquired_by_one_look_in_which_both_foveae_agree() -> None:
    head = head_with(walking_at(1.0))
    click = clicked(head)
    pass_frames(head, click, 3)
    x_px, y_px = click.place_px
    found = acquire(
        head,
        head.calibration,
        PixelTarget(x_px=x_px, y_px=y_px),
        clicked=click.frame,
        speed_px_s=click.speed_px_s,
        clock=head.clock,
    )
    assert found is not None
    assert head.looks <= 3
    truth = (*head.shift_m(found.sighting.left.t_ns), Z_M)
    np.testing.assert_allclose(found.point.point_rig_m, truth, atol=0.03)
    assert found.velocity_rig_m_s == pytest.approx((1.0, 0.0, 0.0), abs=0.1)


@pytest.mark.parametrize("speed_m_s", [0.0, 0.8])
def test_the_first_look_finds_what_stands_and_what_moves(speed_m_s: float) -> None:
    head = head_with(walking_at(speed_m_s))
    click = clicked(head)
    pass_frames(head, click, 2)
    assert (math.hypot(*click.speed_px_s) > MOVES_PX_S) == (speed_m_s > 0.0)
    x_px, y_px = click.place_px
    found = look_first(
        head,
        head.calibration,
        PixelTarget(x_px=x_px, y_px=y_px),
        click,
        clock=head.clock,
        context=Nothing(),  # type: ignore[arg-type]  # knows nothing
    )
    truth = (*head.shift_m(found.sighting.left.t_ns), Z_M)
    np.testing.assert_allclose(found.point.point_rig_m, truth, atol=0.03)


def test_new_frames_are_taken_until_the_click_was_found_in_two() -> None:
    head = head_with(walking_at(0.6))
    click = clicked(head)

    class Ticking:
        taken = 0

        def wide(self, *, max_age_ms: float = 200.0) -> object:
            self.taken += 1
            head.clock.sleep_until_ns(head.clock.now_ns() + FRAME_NS)
            return head.wide()

    ticking = Ticking()
    refresh(ticking, click)  # type: ignore[arg-type]  # wide frames alone
    assert ticking.taken == 2
    assert click.place_px == pytest.approx(pixel_of(head, head.clock.now_ns()), abs=1.0)


def test_a_click_without_texture_is_refused() -> None:
    head = PlaneHead(z_m=Z_M, texture=np.full((2048, 2048), 128.0, dtype=np.float32), noise=0.0)
    with pytest.raises(OutOfRange, match="nothing that could be followed"):
        clicked(head)


def test_a_target_moves_with_its_middle_and_has_the_sides_that_were_drawn() -> None:
    box = RectangleTarget(x_px=100.0, y_px=50.0, width_px=80.0, height_px=10.0)
    assert middle_px(box) == (140.0, 55.0)
    moved = moved_to(box, (150.0, 45.0))
    assert isinstance(moved, RectangleTarget)
    assert (moved.x_px, moved.y_px, moved.width_px) == (110.0, 40.0, 80.0)
    ahead = DirectionTarget(ax_rad=0.1, ay_rad=0.0)
    assert moved_to(ahead, (1.0, 2.0)) is ahead
    assert sides_px(box, 64) == (80, 16)
    assert sides_px(ahead, 64) == (64, 64)


def test_between_looks_a_target_goes_on_as_it_moved_and_comes_to_rest() -> None:
    seen = PositionEstimate(
        t_ns=1_000_000_000,
        position_rig_m=np.array([0.5, -0.1, 6.0]),
        velocity_rig_m_s=np.array([1.2, 0.0, -0.4]),
        covariance=np.eye(6),
    )
    soon = position_at(seen, 1_020_000_000)
    assert soon == pytest.approx((0.524, -0.1, 5.992), abs=1e-3)
    late = position_at(seen, 60_000_000_000)
    assert late == pytest.approx((0.5 + 1.2 * FADING_S, -0.1, 6.0 - 0.4 * FADING_S))
    assert position_at(seen, 750_000_000) == pytest.approx((0.2, -0.1, 6.1))
