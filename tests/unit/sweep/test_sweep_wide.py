"""The wide frames of a pose: only fresh ones count, all must show the rig at rest, and their mean is kept."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.support.scenes.binned_head import BinnedHead
from tests.support.scenes.marker_images import draw_marker, homography

from foveacam_hardware.contract import Frame, LookOptions, Role, Sighting, StereoVolts, Timeout, VirtualClock
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.markers import middle_px
from foveacam_pipeline.calibrate.sweep.sweep_wide import WideMarkersAtRest, next_wide_frame

PERIOD_NS = 33_000_000
EXPOSURE_NS = 8_000_000
READY_NS = 9_000_000
LAYOUT = MarkerLayout()
WIDE_SIZE = (140, 120)


class WideHead:
    """A head with a free-running wide camera that shows one marker, wherever `place` says at a frame."""

    def __init__(
        self, clock: VirtualClock, place: Callable[[int], float] = lambda _: 70.0, *, running: bool = True
    ) -> None:
        self._clock = clock
        self._place = place
        self._running = running

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        now_ns = self._clock.now_ns()
        seq = (now_ns - READY_NS) // PERIOD_NS if self._running else 0
        if now_ns - seq * PERIOD_NS > max_age_ms * 1e6 and self._running:
            seq += 1
            self._clock.sleep_until_ns(seq * PERIOD_NS + READY_NS)
        placed = homography(38.0, (self._place(seq), 60.2), turn_rad=0.1)
        image = draw_marker(0, placed, size=WIDE_SIZE, blur_px=0.6, seed=seq, finer=3)
        return Frame(image=image, role=Role.WIDE, seq=seq, t_ns=seq * PERIOD_NS, exposure_ns=EXPOSURE_NS)

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        raise NotImplementedError

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        raise NotImplementedError

    def set_low_pass(self, cutoff_hz: int) -> int:
        raise NotImplementedError


def test_a_frame_that_was_begun_before_the_rig_came_to_rest_does_not_count() -> None:
    clock = VirtualClock(10 * PERIOD_NS - 2_000_000)  # while frame 10 is being exposed

    frame = next_wide_frame(WideHead(clock), clock, since_ns=clock.now_ns())

    assert frame.seq == 11


def test_a_camera_that_stands_still_is_stale() -> None:
    clock = VirtualClock(1_000_000_000)

    with pytest.raises(Timeout, match="its newest frame is 1000 ms too old"):
        next_wide_frame(WideHead(clock, running=False), clock, since_ns=clock.now_ns())


def test_the_frames_at_rest_are_averaged() -> None:
    clock = VirtualClock(1_000_000_000)
    at_rest = WideMarkersAtRest(WideHead(clock), clock, LAYOUT, since_ns=clock.now_ns())

    at_rest.fill(4)

    mean = at_rest.mean_views()[0]
    assert at_rest.moved_px() < 0.05
    assert np.allclose(middle_px(mean), [70.0, 60.2], atol=0.03)
    assert mean.sigma_px == pytest.approx(at_rest.views[0].sigma_px / 2.0, rel=0.3)


def test_binned_frames_at_rest_show_the_markers_at_the_same_places_of_the_sensor() -> None:
    clock = VirtualClock(1_000_000_000)
    at_rest = WideMarkersAtRest(BinnedHead(WideHead(clock)), clock, LAYOUT, since_ns=clock.now_ns())

    at_rest.fill(4)

    assert at_rest.size == WIDE_SIZE
    assert at_rest.moved_px() < 0.05
    assert np.allclose(middle_px(at_rest.mean_views()[0]), [70.0, 60.2], atol=0.03)


def test_a_rig_that_is_not_at_rest_is_noticed() -> None:
    clock = VirtualClock(1_000_000_000)
    head = WideHead(clock, place=lambda seq: 70.0 + 0.4 * (seq % 4))
    at_rest = WideMarkersAtRest(head, clock, LAYOUT, since_ns=clock.now_ns())

    at_rest.fill(4)

    assert at_rest.moved_px() == pytest.approx(0.6, abs=0.05)


def test_a_marker_that_was_covered_meanwhile_is_out() -> None:
    clock = VirtualClock(1_000_000_000)
    first = clock.now_ns() // PERIOD_NS + 1
    head = WideHead(clock, place=lambda seq: 70.0 if seq <= first else 500.0)
    at_rest = WideMarkersAtRest(head, clock, LAYOUT, since_ns=clock.now_ns())

    at_rest.fill(3)

    assert list(at_rest.views) == [0]
    assert at_rest.mean_views() == {}
    assert at_rest.moved_px() == math.inf  # nobody knows by how much
