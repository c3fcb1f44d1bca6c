"""How the bench of steering judges what was sent and what arrived."""

import pytest

from foveacam_bench.stream.steering import SentTarget, judge

BIAS_CODE, VOLT_CODES = 29_490, 65_535 / 200
MS = 1_000_000


def codes(*axes_v: float) -> tuple[int, ...]:
    half = [round(axis_v * VOLT_CODES / 2) for axis_v in axes_v]
    return tuple(code for each in half for code in (BIAS_CODE + each, BIAS_CODE - each))


def test_the_age_of_a_target_ends_with_the_first_update_towards_it() -> None:
    sent = [
        SentTarget(t_ns=0, axis=0, value_v=15.0),
        SentTarget(t_ns=16 * MS, axis=3, value_v=-15.0),
        SentTarget(t_ns=32 * MS, axis=0, value_v=-15.0),
    ]
    drives = [
        (3 * MS, codes(-15.0, 0.0, 0.0, 15.0)),
        (5 * MS, codes(-12.0, 0.0, 0.0, 15.0)),
        (15 * MS, codes(15.0, 0.0, 0.0, 15.0)),
        (18 * MS, codes(15.0, 0.0, 0.0, 10.0)),
        (42 * MS, codes(11.0, 0.0, 0.0, -15.0)),
    ]

    figures = judge(sent, drives)

    assert figures["steer_age_p50_ms"] == pytest.approx(5.0)
    assert figures["steer_age_p99_ms"] == pytest.approx(10.0, abs=0.2)
    assert figures["steer_updates_per_s"] == pytest.approx(4 / 0.032)
    assert (figures["steer_targets"], figures["steer_targets_lost"]) == (3, 0)
