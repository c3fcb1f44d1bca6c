"""The rate of position updates, in virtual time: up step by step, halved when the link is full."""

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foveacam_hardware.drivers.controller.update_rate import UpdateRateGovernor

TENTH_NS = 100_000_000
SECOND_NS = 1_000_000_000


@dataclass
class Link:
    """How the link looks to the governor."""

    stalls: int = 0
    queued_bytes: int = 0
    rtt_p95_ms: float | None = 0.4


def governor(*, baseline_ms: float = 2.0) -> UpdateRateGovernor:
    built = UpdateRateGovernor()
    built.begin(0, baseline_ms=baseline_ms)
    return built


def look(built: UpdateRateGovernor, t_ns: int, link: Link) -> float:
    built.adjust(t_ns, stalls=link.stalls, queued_bytes=link.queued_bytes, rtt_p95_ms=link.rtt_p95_ms)
    return built.rate_hz


def test_it_starts_at_the_ceiling_and_stays_there_on_a_good_link() -> None:
    built = governor()

    assert [look(built, tenth * TENTH_NS, Link()) for tenth in range(5)] == [1000.0] * 5


@pytest.mark.parametrize(
    "full", [Link(stalls=1), Link(queued_bytes=1025), Link(rtt_p95_ms=4.1)], ids=["write", "queue", "slow"]
)
def test_each_sign_of_a_full_link_halves_the_rate(full: Link) -> None:
    built = governor()

    assert look(built, TENTH_NS, full) == 500.0


@pytest.mark.parametrize("good", [Link(queued_bytes=1024), Link(rtt_p95_ms=4.0), Link(rtt_p95_ms=None)])
def test_what_is_just_within_the_limits_halves_nothing(good: Link) -> None:
    assert look(governor(), TENTH_NS, good) == 1000.0


def test_it_recovers_by_25_hz_a_tenth_of_a_second() -> None:
    built = governor()
    look(built, TENTH_NS, Link(queued_bytes=5000))

    rates = [look(built, tenth * TENTH_NS, Link()) for tenth in (2, 3, 4, 14)]

    assert rates == [525.0, 550.0, 575.0, 825.0]


def test_it_never_falls_below_the_floor_nor_rises_above_the_ceiling() -> None:
    built = governor()
    full = [look(built, tenth * TENTH_NS, Link(rtt_p95_ms=50.0)) for tenth in range(1, 8)]

    assert full == [500.0, 250.0, 125.0, 62.5, 60.0, 60.0, 60.0]
    assert look(built, 100 * SECOND_NS, Link()) == 1000.0


def test_the_link_is_looked_at_once_a_tenth_of_a_second() -> None:
    built = governor()
    look(built, TENTH_NS, Link(queued_bytes=5000))

    assert not built.adjustment_due(TENTH_NS + 1)
    assert look(built, TENTH_NS + 50_000_000, Link(queued_bytes=5000)) == 500.0
    assert built.adjustment_due(2 * TENTH_NS)


def test_a_stalled_write_counts_once() -> None:
    built = governor()
    link = Link(stalls=3)

    assert [look(built, tenth * TENTH_NS, link) for tenth in (1, 2)] == [500.0, 525.0]


def test_a_baseline_below_a_usb_frame_does_not_make_the_scheduler_a_full_link() -> None:
    assert look(governor(baseline_ms=0.05), TENTH_NS, Link(rtt_p95_ms=1.9)) == 1000.0


def test_a_link_may_have_a_longer_baseline_than_its_round_trips_at_the_connect() -> None:
    built = UpdateRateGovernor(least_baseline_ms=10.0)
    built.begin(0, baseline_ms=0.3)

    assert look(built, TENTH_NS, Link(rtt_p95_ms=19.0)) == 1000.0
    assert look(built, 2 * TENTH_NS, Link(rtt_p95_ms=21.0)) == 500.0


@given(st.lists(st.integers(0, 3_000_000), min_size=50, max_size=200))
def test_no_second_has_more_updates_than_the_rate(pauses_ns: list[int]) -> None:
    built = governor()
    t_ns, sent_ns = 0, []
    for pause_ns in pauses_ns:
        t_ns = built.reserve(t_ns + pause_ns)
        sent_ns.append(t_ns)

    for first in sent_ns:
        assert sum(first <= t < first + 50_000_000 for t in sent_ns) <= 50


@pytest.mark.parametrize(("rtt_p95_ms", "hold_ms"), [(None, 5), (0.3, 5), (10.0, 20), (400.0, 100)])
def test_an_update_waits_between_5_and_100_ms_behind_a_request(
    rtt_p95_ms: float | None, hold_ms: int
) -> None:
    assert governor().hold_ns(rtt_p95_ms) == hold_ms * 1_000_000
