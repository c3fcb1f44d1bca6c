"""The automatic exposure of the simulated cameras, without a camera: what a picture says of the next one."""

import numpy as np
import pytest

from foveacam_hardware.contract import CameraSettings, Image
from foveacam_hardware.sim.exposures import (
    AUTO_LIMITS_NS,
    FreeRunningSchedule,
    next_exposure,
    overexposure_log2,
)

MS = 1_000_000
S = 1_000_000_000


def grey(level: float, *, bits: int = 8) -> Image:
    value = round(level * (2**bits - 1))
    return np.full((64, 64), value, np.uint8) if bits == 8 else np.full((64, 64), value, np.uint16)


def stops(image: Image, *, bits: int = 8, black_level: float = 0.0) -> float:
    return overexposure_log2(image, bits=bits, black_level=black_level)


@pytest.mark.parametrize("bits", [8, 12])
def test_half_the_light_is_one_stop_too_dark_at_any_depth(bits: int) -> None:
    assert stops(grey(0.25, bits=bits), bits=bits) == pytest.approx(-1.0, abs=0.02)
    assert stops(grey(0.5, bits=bits), bits=bits) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("bits", [8, 12])
def test_a_raised_black_is_no_light_at_any_depth(bits: int) -> None:
    lifted = grey(0.25, bits=bits) + np.uint8(20) * np.uint16(2 ** (bits - 8))

    found = stops(lifted, bits=bits, black_level=20.0)
    assert found == pytest.approx(np.log2(63.75 / 235.0 / 0.5), abs=0.02)


def test_a_few_bright_places_hold_it_back_and_clipped_ones_push_it_down() -> None:
    bright = grey(0.1)
    bright[:, ::16] = 250  # a lamp: every eighth column is measured, so half of them
    clipped = bright.copy()
    clipped[:, ::16] = 255

    assert stops(bright) > stops(grey(0.1))
    assert stops(clipped) >= 0.5


@pytest.mark.parametrize(("too_bright", "factor"), [(-3.0, 2.0), (-0.5, 2**0.5), (0.5, 2**-0.5), (5.0, 0.25)])
def test_a_step_is_what_is_lacking_up_to_a_limit(too_bright: float, factor: float) -> None:
    found = next_exposure(8 * MS, too_bright, longest_ns=S)

    assert found.exposure_ns == pytest.approx(8 * MS * factor, rel=1e-6)
    assert not found.settled


def test_what_is_good_enough_is_left_alone() -> None:
    found = next_exposure(8 * MS, 0.06, longest_ns=S)

    assert (found.exposure_ns, found.settled) == (8 * MS, True)


@pytest.mark.parametrize(
    ("begin_ns", "too_bright", "longest_ns", "end_ns"),
    [
        (5 * MS, -9.0, S, AUTO_LIMITS_NS[1]),
        (5 * MS, -9.0, 33 * MS, 33 * MS),
        (5 * MS, 9.0, S, AUTO_LIMITS_NS[0]),
    ],
)
def test_it_stops_at_its_limits_and_calls_that_settled(
    begin_ns: int, too_bright: float, longest_ns: int, end_ns: int
) -> None:
    exposure_ns, settled, steps = begin_ns, False, 0
    while not settled:
        found = next_exposure(exposure_ns, too_bright, longest_ns=longest_ns)
        exposure_ns, settled, steps = found.exposure_ns, found.settled, steps + 1

    assert exposure_ns == end_ns
    assert steps < 10


# The slots of a camera whose exposure changes while it runs ------------------------------------------------

AT_20_MS = CameraSettings(exposure_ns=20 * MS, frame_rate_hz=30.0)
AT_4_MS = CameraSettings(exposure_ns=4 * MS, frame_rate_hz=30.0)
FASTER = CameraSettings(exposure_ns=4 * MS, frame_rate_hz=100.0, frame_rate_auto=True)
SLOT_NS = round(1e9 / 30.0)


def read_all(run: FreeRunningSchedule, *, until_ns: int) -> list[tuple[int, int, int]]:
    """Read whatever can be read by then: number, start and exposure of each."""
    found, now_ns = [], 0
    while now_ns <= until_ns:
        exposure = run.oldest(now_ns)
        assert exposure is not None
        now_ns = max(now_ns, exposure.ready_ns)
        assert run.consume(exposure) == 0
        found.append((exposure.seq, exposure.interval.start_ns, exposure.interval.length_ns))
    return found


def test_a_slot_that_has_begun_goes_on_and_the_next_one_changes() -> None:
    run = FreeRunningSchedule(AT_20_MS, start_ns=0, first_seq=7)
    run.adjust(AT_4_MS, now_ns=SLOT_NS + MS)
    found = read_all(run, until_ns=4 * SLOT_NS)

    assert [exposure_ns for _, _, exposure_ns in found[:4]] == [20 * MS, 20 * MS, 4 * MS, 4 * MS]
    assert [seq for seq, _, _ in found] == list(range(7, 7 + len(found)))
    assert [start_ns for _, start_ns, _ in found] == [slot * SLOT_NS for slot in range(len(found))]


def test_another_rate_begins_with_the_next_slot() -> None:
    run = FreeRunningSchedule(AT_20_MS, start_ns=0, first_seq=0)
    run.adjust(FASTER, now_ns=MS)
    found = read_all(run, until_ns=2 * SLOT_NS)

    assert [start_ns for _, start_ns, _ in found[:4]] == [0, SLOT_NS, SLOT_NS + 10 * MS, SLOT_NS + 20 * MS]


def test_of_two_changes_before_a_slot_the_last_counts() -> None:
    run = FreeRunningSchedule(AT_20_MS, start_ns=0, first_seq=0)
    run.adjust(FASTER, now_ns=MS)
    run.adjust(AT_4_MS, now_ns=2 * MS)
    found = read_all(run, until_ns=2 * SLOT_NS)

    assert [(start_ns, exposure_ns) for _, start_ns, exposure_ns in found[:3]] == [
        (0, 20 * MS),
        (SLOT_NS, 4 * MS),
        (2 * SLOT_NS, 4 * MS),
    ]


def test_the_newest_slot_is_found_across_a_change() -> None:
    run = FreeRunningSchedule(AT_20_MS, start_ns=0, first_seq=0)
    run.adjust(FASTER, now_ns=SLOT_NS + MS)
    before, after = run.newest(2 * SLOT_NS), run.newest(2 * SLOT_NS + 35 * MS)

    assert before is not None
    assert after is not None
    assert (before.seq, after.seq) == (1, 4)
