"""The serial bench: its figures are complete, and within the bars that no machine is too slow for."""

import pytest

from foveacam_bench.drivers.mirror_link import run

pytestmark = pytest.mark.slow


def test_lost_bytes_are_recovered_or_reported_within_a_second_and_no_update_is_lost() -> None:
    figures = run(quick=True)

    assert figures["recovery_median_s"] <= 1.0
    assert (
        figures["recovery_s"] <= 10.0
    )  # of dozens, one may fall into a moment when this machine stands still
    assert figures["parked"] is True
    assert figures["recovered"] + figures["reported"] == figures["damages"] > 0
    assert figures["reported"] > 0  # the strict controller has stopped at least once
    assert figures["updates_lost"] == 0
    assert 0 < figures["rtt_p50_ms"] <= figures["rtt_p99_ms"]
    assert figures["rtt_ratio"] > 0
    assert figures["updates_per_s"] > 0  # how many a second, the bench says beside a bare loop
