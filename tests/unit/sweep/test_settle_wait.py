"""How long a rig shall wait after a move, from how a smaller step settled."""

from dataclasses import replace

import pytest
from tests.support.scenes.settle_report import AXIS, LARGEST_DEG, MEASURED_US, REPORT, STEP_DEG, STEP_V

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.settle.settle_resonance import largest_move_us, settle_wait_us
from foveacam_pipeline.calibrate.settle.settle_values import MirrorResonance

LARGEST_V = STEP_V * LARGEST_DEG / STEP_DEG


def test_larger_move_takes_as_much_longer_as_the_filter_says() -> None:
    # a fifth-order Bessel filter: 1183 / fc ms to a pixel after 2.23°, 1548 / fc ms after 20°
    found_us = largest_move_us(REPORT, AXIS, move_v=LARGEST_V)
    assert found_us - MEASURED_US == pytest.approx(1e3 * (1548.0 - 1183.0) / 120.0, abs=60.0)


def test_mirror_that_rings_takes_longer_still() -> None:
    ringing = MirrorResonance(frequency_hz=300.0, quality=20.0, frequency_sigma_hz=1.0, quality_sigma=0.5)
    rung_us = largest_move_us(REPORT, replace(AXIS, resonance=ringing), move_v=LARGEST_V)
    assert rung_us > largest_move_us(REPORT, AXIS, move_v=LARGEST_V) + 5_000.0


@pytest.mark.parametrize("move_v", [1.0, STEP_V])
def test_wait_is_never_shorter_than_what_was_measured(move_v: float) -> None:
    assert largest_move_us(REPORT, AXIS, move_v=move_v) >= MEASURED_US


def test_rig_waits_for_its_slowest_axis_in_whole_tenths_of_a_millisecond() -> None:
    slow = replace(AXIS, role=Role.RIGHT, settle_us=MEASURED_US + 1_000.0)
    found_us = settle_wait_us(replace(REPORT, axes=(AXIS, slow)), max_v=LARGEST_V / 2.0)
    assert found_us % 100 == 0
    assert 0.0 <= found_us - largest_move_us(REPORT, slow, move_v=LARGEST_V) < 100.0
