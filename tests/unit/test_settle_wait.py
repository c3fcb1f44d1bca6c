"""How long a rig shall wait after a move, from how a smaller step settled."""

from dataclasses import replace

import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, Resonance, SettleReport, Trace
from foveacam_pipeline.calibrate.settle.settle_wait import largest_move_us, wait_us

PX_PER_DEG = 502.0
STEP_DEG, LARGEST_DEG = 2.23, 20.0
STEP_V = 38.0
MEASURED_US = 9_858.0
TRACE = Trace(times_us=(0.0, MEASURED_US), left_px=(STEP_DEG * PX_PER_DEG, 1.0))
AXIS = AxisSettle(
    role=Role.LEFT,
    axis="x",
    step_v=STEP_V,
    step_px=STEP_DEG * PX_PER_DEG,
    noise_px=0.01,
    settle_us=MEASURED_US,
    settle_share_us=5_700.0,
    resonance=None,
    ringing="not resolvable",
    trace=TRACE,
    open_trace=TRACE,
)
REPORT = SettleReport(
    rig_id="rig-1",
    created_utc="2026-02-01T00:00:00+00:00",
    low_pass_hz=120,
    exposure_us=50.0,
    limit_px=1.0,
    limit_share=0.01,
    axes=(AXIS,),
)
LARGEST_V = STEP_V * LARGEST_DEG / STEP_DEG


def test_larger_move_takes_as_much_longer_as_the_filter_says() -> None:
    # a fifth-order Bessel filter: 1183 / fc ms to a pixel after 2.23°, 1548 / fc ms after 20°
    found_us = largest_move_us(REPORT, AXIS, move_v=LARGEST_V)
    assert found_us - MEASURED_US == pytest.approx(1e3 * (1548.0 - 1183.0) / 120.0, abs=60.0)


def test_mirror_that_rings_takes_longer_still() -> None:
    ringing = Resonance(frequency_hz=300.0, quality=20.0, frequency_sigma_hz=1.0, quality_sigma=0.5)
    rung_us = largest_move_us(REPORT, replace(AXIS, resonance=ringing), move_v=LARGEST_V)
    assert rung_us > largest_move_us(REPORT, AXIS, move_v=LARGEST_V) + 5_000.0


@pytest.mark.parametrize("move_v", [1.0, STEP_V])
def test_wait_is_never_shorter_than_what_was_measured(move_v: float) -> None:
    assert largest_move_us(REPORT, AXIS, move_v=move_v) >= MEASURED_US


def test_rig_waits_for_its_slowest_axis_in_whole_tenths_of_a_millisecond() -> None:
    slow = replace(AXIS, role=Role.RIGHT, settle_us=MEASURED_US + 1_000.0)
    found_us = wait_us(replace(REPORT, axes=(AXIS, slow)), max_v=LARGEST_V / 2.0)
    assert found_us % 100 == 0
    assert 0.0 <= found_us - largest_move_us(REPORT, slow, move_v=LARGEST_V) < 100.0
