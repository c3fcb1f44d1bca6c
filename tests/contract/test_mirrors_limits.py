"""Limits that the mirror driver keeps above the wire, its rounding, and its map of the clock."""

import math
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foveacam_hardware.contract import (
    PARKED,
    Busy,
    InvalidInput,
    MirrorLimits,
    MirrorVolts,
    OutOfRange,
    StereoVolts,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.clock import ClockMap
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.controller.volts import mirror_codes, mirror_volts
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController

STEP_V = 200 / 65_535
BIAS_CODE = 29_490


class Rig:
    def __init__(self, limits: MirrorLimits) -> None:
        clock = VirtualClock(1_000_000_000)
        self.cables = RecordingCables()
        self.controller = LoopbackController(clock, self.cables, strict=True)
        self.mirrors = ControllerMirrors(self.controller.open, clock, limits)
        self.mirrors.connect()

    @property
    def asked(self) -> int:
        """Packets that have reached the controller."""
        return self.mirrors.telemetry.tx_packets

    def differences_v(self) -> list[float]:
        codes = self.cables.codes
        return [(codes[i] - codes[i + 1]) * STEP_V for i in (0, 2, 4, 6)]


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    built = Rig(MirrorLimits())
    yield built
    built.mirrors.close()


def stereo(axes_v: tuple[float, float, float, float]) -> StereoVolts:
    left_x, left_y, right_x, right_y = axes_v
    return StereoVolts(left=MirrorVolts(x_v=left_x, y_v=left_y), right=MirrorVolts(x_v=right_x, y_v=right_y))


ANY_AXES = st.tuples(*[st.floats(allow_nan=True, allow_infinity=True) | st.floats(-200, 200)] * 4)
GOOD_AXES = st.tuples(*[st.floats(-170, 170)] * 4)


@given(ANY_AXES)
@settings(max_examples=300, deadline=None)  # a busy machine may stand still in between
def test_what_is_not_finite_or_too_high_never_reaches_the_wire(
    rig: Rig, axes_v: tuple[float, float, float, float]
) -> None:
    asked, drives, state = rig.asked, len(rig.cables.drives), rig.mirrors.state
    allowed = all(math.isfinite(value_v) and abs(value_v) <= 170 + STEP_V / 2 for value_v in axes_v)

    if allowed:
        rig.mirrors.steer(stereo(axes_v))
        assert rig.asked == asked + 1
        return
    with pytest.raises(OutOfRange, match=r"mirror [LR] [xy]"):
        rig.mirrors.steer(stereo(axes_v))
    with pytest.raises(OutOfRange, match=r"mirror [LR] [xy]"):
        rig.mirrors.expose(stereo(axes_v), settle_us=0, pulse_us=1000)
    assert (rig.asked, len(rig.cables.drives), rig.mirrors.state) == (asked, drives, state)


@given(GOOD_AXES)
@settings(max_examples=300, deadline=None)
def test_the_volts_returned_are_the_mirrors_and_within_half_a_code(
    rig: Rig, axes_v: tuple[float, float, float, float]
) -> None:
    actual = rig.mirrors.steer(stereo(axes_v))

    told = (actual.left.x_v, actual.left.y_v, actual.right.x_v, actual.right.y_v)
    assert told == pytest.approx(rig.differences_v(), abs=1e-12)
    assert told == pytest.approx(axes_v, abs=STEP_V / 2 * (1 + 1e-9))
    codes = rig.cables.codes
    assert all(abs(codes[i] + codes[i + 1] - 2 * BIAS_CODE) <= 1 for i in (0, 2, 4, 6))
    assert all(0 <= code * STEP_V <= 200 for code in codes)


def test_a_drive_at_the_limit_is_set_again_as_it_was_read_back(rig: Rig) -> None:
    at_limit = rig.mirrors.steer(stereo((170.0, -170.0, 0.0, 0.0)))

    assert at_limit.left.x_v > 170.0  # rounded to the nearest code
    assert rig.mirrors.steer(at_limit) == at_limit


@given(st.floats(-170, 170), st.floats(-170, 170))
@settings(deadline=None)
def test_the_volts_really_set_are_set_again_exactly(x_v: float, y_v: float) -> None:
    codes = mirror_codes(MirrorVolts(x_v=x_v, y_v=y_v), bias=BIAS_CODE)

    assert mirror_codes(mirror_volts(codes), bias=BIAS_CODE) == codes


def test_a_step_beyond_the_slew_limit_is_refused_and_nothing_moves() -> None:
    rig = Rig(MirrorLimits(max_slew_v=50))
    rig.mirrors.steer(stereo((40, 0, 0, 0)))
    codes = rig.cables.codes

    with pytest.raises(OutOfRange, match=r"mirror L x: a step of -60\.000 V .* smaller steps"):
        rig.mirrors.steer(stereo((-20, 0, 0, 0)))

    assert rig.cables.codes == codes
    rig.mirrors.steer(stereo((0, 0, 0, 0)))
    rig.mirrors.close()


def test_park_is_no_subject_to_the_slew_limit() -> None:
    rig = Rig(MirrorLimits(max_slew_v=50))
    for x_v in (40, 80, 120):
        rig.mirrors.steer(stereo((x_v, 0, 0, 0)))

    rig.mirrors.park()

    assert rig.cables.codes == (BIAS_CODE,) * 8
    assert rig.mirrors.state.volts == PARKED
    rig.mirrors.close()


@pytest.mark.parametrize(
    "limits", [MirrorLimits(bias_v=20), MirrorLimits(bias_v=150), MirrorLimits(max_v=250)]
)
def test_limits_that_leave_the_dacs_range_are_refused_before_anything_is_opened(limits: MirrorLimits) -> None:
    with pytest.raises(InvalidInput, match=r"0\.\.200 V"):
        ControllerMirrors(lambda: pytest.fail("opened"), VirtualClock(), limits)


def test_a_swing_that_would_round_below_zero_is_refused_though_its_volts_fit() -> None:
    with pytest.raises(InvalidInput, match=r"0\.\.200 V"):
        ControllerMirrors(
            lambda: pytest.fail("opened"), VirtualClock(), MirrorLimits(bias_v=63.27, max_v=126.54)
        )


@pytest.mark.parametrize("value_v", [10**400, -(10**400), 2**63])
def test_a_number_that_no_float_can_hold_is_refused_in_words(rig: Rig, value_v: int) -> None:
    with pytest.raises(OutOfRange, match="mirror L x: a million or more V is outside"):
        rig.mirrors.steer(stereo((value_v, 0, 0, 0)))


@pytest.mark.parametrize("cutoff_hz", [2.5, 0, 1001, math.nan])
def test_a_filter_that_there_is_not_is_refused(rig: Rig, cutoff_hz: float) -> None:
    with pytest.raises(OutOfRange, match="whole numbers from 1 to 1000"):
        rig.mirrors.set_low_pass(cutoff_hz)  # type: ignore[arg-type]  # what a careless caller gives


@pytest.mark.parametrize(("stood_ms", "waits_ms"), [(0.0, 14.0), (9.0, 14.0), (20.0, 0.0)])
def test_an_exposure_waits_where_the_mirrors_have_stood_for_less_than_the_settling_time(
    rig: Rig, stood_ms: float, waits_ms: float
) -> None:
    clock = rig.controller.clock
    rig.mirrors.steer(PARKED)
    there = rig.mirrors.steer(stereo((30.0, 0.0, 30.0, 0.0)))
    asked_ns = clock.now_ns() + round(stood_ms * 1e6)
    clock.sleep_until_ns(asked_ns)

    rig.mirrors.expose(there, settle_us=14_000, pulse_us=4000)

    # The messages take less than half a millisecond
    assert (rig.cables.triggers[-1].t_ns - asked_ns) / 1e6 == pytest.approx(waits_ms, abs=0.5)


def test_another_bias_is_the_one_in_force() -> None:
    rig = Rig(MirrorLimits(bias_v=80, max_v=158))

    assert rig.cables.codes == (int(65_535 * 80 / 200),) * 8
    rig.mirrors.close()


def test_the_quickest_ping_maps_the_clock() -> None:
    clock_map = ClockMap()
    for controller_us, delay_out_us, delay_back_us in ((1000, 10, 5000), (8000, 20, 20), (15_000, 9000, 40)):
        clock_map.add(
            sent_ns=(controller_us - delay_out_us) * 1000 + 7_000_000,
            received_ns=(controller_us + delay_back_us) * 1000 + 7_000_000,
            controller_us=controller_us,
        )

    assert clock_map.host_ns(20_000) == 27_000_000


@pytest.mark.parametrize("read_at_us", [0, 200])
def test_the_uncertainty_of_the_clock_is_the_largest_error_of_a_ping(read_at_us: int) -> None:
    clock_map = ClockMap()
    clock_map.add(sent_ns=0, received_ns=200_000, controller_us=5000 + read_at_us)

    # The clock was read as the question left or as the answer arrived, and the middle is assumed
    error_ns = abs(clock_map.host_ns(5000 + read_at_us) - read_at_us * 1000)
    assert clock_map.uncertainty_ns(100_000) == error_ns == 100_000
    assert clock_map.uncertainty_ns(1_000_100_000) == 200_000  # two crystals drift by 100 ppm at most


def test_a_drifting_clock_is_followed_by_newer_pings() -> None:
    clock_map = ClockMap()
    for second in range(600):
        host_ns = second * 1_000_000_000
        controller_us = round(host_ns * (1 + 50e-6) / 1000)
        assert clock_map.add(
            sent_ns=host_ns - 50_000, received_ns=host_ns + 50_000, controller_us=controller_us
        )

    at_ns = 599_500_000_000
    # Half a second at 50 ppm is 25 µs; the rounding of the controller's clock adds one.
    assert clock_map.host_ns(round(at_ns * (1 + 50e-6) / 1000)) == pytest.approx(at_ns, abs=26_000)


def test_a_clock_that_begins_again_is_a_restart_and_the_old_map_is_dropped() -> None:
    clock_map = ClockMap()
    assert clock_map.add(sent_ns=10**9, received_ns=10**9, controller_us=900_000)
    assert not clock_map.add(sent_ns=2 * 10**9, received_ns=2 * 10**9, controller_us=1_000)

    assert clock_map.host_ns(2_000) == 2 * 10**9 + 1_000_000


def test_receipts_stay_on_the_hosts_clock_while_the_controllers_drifts() -> None:
    clock = VirtualClock(1_000_000_000)
    cables = RecordingCables()
    controller = LoopbackController(clock, cables)
    controller.configure(clock_ppm=80.0)
    mirrors = ControllerMirrors(controller.open, clock)
    mirrors.connect()
    for _ in range(50):
        clock.sleep_until_ns(clock.now_ns() + 1_500_000_000)
        receipt = mirrors.expose(PARKED, settle_us=0, pulse_us=4000)
        # A ping is at most 2 s old: 160 µs at 80 ppm, and a microsecond of rounding.
        assert receipt.t_trigger_ns == pytest.approx(cables.triggers[-1].t_ns, abs=162_000)
    mirrors.close()


def test_exposures_that_nobody_waits_for_do_not_block_others_for_ever() -> None:
    rig = Rig(MirrorLimits())
    for _ in range(2):
        rig.mirrors.begin_exposure(PARKED, settle_us=0, pulse_us=4000)
    with pytest.raises(Busy, match="2 are under way"):
        rig.mirrors.expose(PARKED, settle_us=0, pulse_us=4000)

    rig.controller.clock.sleep_until_ns(rig.controller.clock.now_ns() + 500_000_000)

    assert rig.mirrors.expose(PARKED, settle_us=0, pulse_us=4000).volts == PARKED
    rig.mirrors.close()


def test_a_controller_whose_clock_ran_backwards_has_restarted_however_young_it_was() -> None:
    clock_map = ClockMap()
    assert clock_map.add(sent_ns=1_000_000, received_ns=1_100_000, controller_us=20_000)
    assert clock_map.add(sent_ns=2_000_000, received_ns=2_100_000, controller_us=21_000)

    assert not clock_map.add(sent_ns=3_000_000, received_ns=3_100_000, controller_us=500)
