"""A camera's clock on the host's: offset, drift, late packets, and clocks that are set."""

import numpy as np
import pytest

from foveacam_hardware.drivers.cameras.device import ClockReading, Grab, GrabStatus
from foveacam_hardware.drivers.cameras.frame_times import CameraClock, ExposureTimes

OFFSET_NS = 1_000_000_000_000
LEAST_NS = 300_000
EXPOSURE_NS = 5_000_000
READOUT_NS = 4_000_000


def host(t_device_ns: int, *, drift: float) -> int:
    return t_device_ns + OFFSET_NS + round(drift * t_device_ns)


def observed(*, drift: float, seconds: int, seed: int = 1) -> CameraClock:
    """Return a clock after frames at 30 Hz whose latency is never below the least and often far above."""
    rng = np.random.default_rng(seed)
    clock = CameraClock()
    for frame in range(30 * seconds):
        t_ns = frame * 33_333_333
        clock.observe(t_ns, host(t_ns, drift=drift) + LEAST_NS + round(rng.exponential(2e6)))
    return clock


def drift_ppm(clock: CameraClock) -> float:
    """Return how much faster the host's clock is taken to run."""
    return (clock.host_ns(2_000_000_000) - clock.host_ns(1_000_000_000) - 1_000_000_000) / 1e3


@pytest.mark.parametrize("drift", [0.0, 40e-6, -80e-6])
def test_a_drifting_clock_is_mapped_to_a_tenth_of_a_millisecond(drift: float) -> None:
    clock = observed(drift=drift, seconds=60)
    t_ns = 60_000_000_000

    assert clock.host_ns(t_ns) - LEAST_NS == pytest.approx(host(t_ns, drift=drift), abs=300_000)
    assert drift_ppm(clock) == pytest.approx(drift * 1e6, abs=8.0)


def test_the_first_pair_is_enough_to_begin_with() -> None:
    clock = CameraClock()
    clock.observe(5, 5 + OFFSET_NS)

    assert clock.host_ns(1000) == 1000 + OFFSET_NS


def test_one_quick_frame_among_slow_ones_sets_the_offset() -> None:
    clock = CameraClock()
    for frame, late_ns in enumerate((9_000_000, 7_000_000, 400_000, 8_000_000)):
        clock.observe(frame * 10_000_000, frame * 10_000_000 + OFFSET_NS + late_ns)

    assert clock.host_ns(0) == OFFSET_NS + 400_000


def test_noise_of_the_first_seconds_is_not_taken_for_a_clock_that_runs_wild() -> None:
    clock = CameraClock()
    for second, late_ns in enumerate((0, 5_000_000, 0)):  # 5000 ppm up and down
        clock.observe(second * 1_000_000_000, second * 1_000_000_000 + OFFSET_NS + late_ns)

    assert abs(drift_ppm(clock)) <= 200.0


def grab(t_device_ns: int | None, t_host_ns: int) -> Grab:
    return Grab(
        status=GrabStatus.OK, image=None, bits=8, number=1, t_device_ns=t_device_ns, t_host_ns=t_host_ns
    )


def test_a_frame_is_timed_in_the_middle_of_its_exposure() -> None:
    times = ExposureTimes(readout_ns=READOUT_NS)
    for frame in range(100):
        start_ns = frame * 20_000_000
        arrival_ns = start_ns + OFFSET_NS + EXPOSURE_NS + READOUT_NS + (frame % 7) * 1_000_000
        middle_ns = times.middle_ns(grab(start_ns, arrival_ns), exposure_ns=EXPOSURE_NS)

    assert middle_ns == start_ns + OFFSET_NS + EXPOSURE_NS // 2


def test_without_a_clock_of_the_camera_a_frame_is_timed_by_its_arrival() -> None:
    times = ExposureTimes(readout_ns=READOUT_NS)

    middle_ns = times.middle_ns(grab(None, 100_000_000), exposure_ns=EXPOSURE_NS)

    assert middle_ns == 100_000_000 - READOUT_NS - EXPOSURE_NS // 2


def test_readings_of_the_cameras_clock_leave_no_latency_to_guess() -> None:
    """The readout that nobody told is 12 ms here; by arrivals alone each time would be wrong by it."""
    times = ExposureTimes()
    rng = np.random.default_rng(4)
    for second in range(10):
        t_ns = second * 2_000_000_000
        trip_ns = 200_000 + int(rng.integers(3_000_000))
        before_ns = t_ns + OFFSET_NS - trip_ns // 2
        assert times.reading_due(before_ns)
        times.add_reading(
            ClockReading(t_device_ns=t_ns, t_before_ns=before_ns, t_after_ns=before_ns + trip_ns)
        )
        start_ns = t_ns + 30_000_000
        arrival_ns = start_ns + OFFSET_NS + EXPOSURE_NS + 12_000_000
        middle_ns = times.middle_ns(grab(start_ns, arrival_ns), exposure_ns=EXPOSURE_NS)

    assert middle_ns == pytest.approx(start_ns + OFFSET_NS + EXPOSURE_NS // 2, abs=1_000_000)


def test_a_camera_without_such_a_register_is_not_asked_again() -> None:
    times = ExposureTimes()
    times.add_reading(None)

    assert not times.reading_due(10_000_000_000)


def test_a_clock_that_was_set_back_is_mapped_anew() -> None:
    times = ExposureTimes()
    times.middle_ns(grab(90_000_000_000, OFFSET_NS), exposure_ns=EXPOSURE_NS)
    middle_ns = times.middle_ns(grab(1_000, OFFSET_NS + 33_000_000), exposure_ns=EXPOSURE_NS)

    assert middle_ns == OFFSET_NS + 33_000_000 - EXPOSURE_NS // 2


def test_no_exposure_ends_after_its_frame_arrived() -> None:
    times = ExposureTimes()
    times.add_reading(ClockReading(t_device_ns=0, t_before_ns=OFFSET_NS, t_after_ns=OFFSET_NS))
    middle_ns = times.middle_ns(grab(50_000_000, OFFSET_NS + 20_000_000), exposure_ns=EXPOSURE_NS)

    assert middle_ns == OFFSET_NS + 20_000_000 - EXPOSURE_NS // 2
