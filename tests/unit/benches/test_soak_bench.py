"""The parts of the soak: its clock, the watch on the drives, and whether something grows."""

import os
import threading
import time
from collections import Counter
from pathlib import Path

import pytest

from foveacam_bench.soak.drive_watch import DriveWatch
from foveacam_bench.soak.held import growth_figures
from foveacam_bench.soak.skipping_clock import SkippingClock
from foveacam_bench.soak.soaked_server import Resources, process_resources
from foveacam_hardware.contract import MirrorLimits
from foveacam_hardware.drivers.controller.volts import bias_code

REST = (bias_code(MirrorLimits()),) * 8
DRIVEN = (*REST[:-1], REST[-1] + 100)
HOUR_NS = 3_600_000_000_000


def held(hour: float, rss_mb: float, *, threads: int = 20, sockets: int = 30) -> Resources:
    return Resources(
        t_s=3600.0 * hour,
        rss_mb=rss_mb,
        threads=threads,
        files=Counter({"socket": sockets, "/data/lock": 1}),
        database_mb=1.0 + 0.5 * hour,
    )


def test_whoever_sleeps_wakes_up_when_his_time_is_skipped() -> None:
    clock = SkippingClock()
    due_ns = clock.now_ns() + HOUR_NS
    sleeper = threading.Thread(target=clock.sleep_until_ns, args=(due_ns,))
    sleeper.start()

    clock.skip(HOUR_NS // 2)
    sleeper.join(0.05)
    assert sleeper.is_alive()
    clock.skip(HOUR_NS // 2)
    sleeper.join(10.0)

    assert not sleeper.is_alive()
    assert clock.now_ns() >= due_ns
    assert clock.now_ns() - time.monotonic_ns() == pytest.approx(HOUR_NS, abs=1e9)


def test_only_the_time_counts_in_which_mirrors_are_driven_and_must_rest() -> None:
    watch = DriveWatch(MirrorLimits())
    watch.see(DRIVEN)
    time.sleep(0.02)
    assert watch.unparked_s == 0.0
    watch.require_rest(True)
    time.sleep(0.02)
    watch.see(REST)
    counted_s = watch.unparked_s
    time.sleep(0.02)
    assert 0.02 <= counted_s == watch.unparked_s
    watch.see((0,) * 8)
    time.sleep(0.02)
    assert watch.unparked_s == counted_s


def test_growth_is_counted_from_the_given_sample_on() -> None:
    grown = growth_figures(
        [
            held(0, 500.0),
            held(1, 900.0, threads=25),
            held(2, 902.0, threads=25),
            held(3, 904.0, threads=26, sockets=32),
        ],
        after=1,
    )
    assert grown["rss_slope_mb_per_h"] == pytest.approx(2.0)
    assert grown["database_slope_mb_per_h"] == pytest.approx(0.5)
    assert (grown["threads_growth"], grown["fds_growth"]) == (1, 2)
    assert grown["files_more"] == {"socket": 2}


def test_open_files_are_counted_by_what_they_lead_to(tmp_path: Path) -> None:
    before = process_resources(os.getpid(), tmp_path, t_s=0.0).files
    with (tmp_path / "one").open("w"), (tmp_path / "one").open(), (tmp_path / "two").open("w"):
        more = process_resources(os.getpid(), tmp_path, t_s=0.0).files - before
    assert more == {str(tmp_path / "one"): 2, str(tmp_path / "two"): 1}


def test_a_soak_that_was_cut_at_its_start_has_no_slope() -> None:
    assert growth_figures([held(0, 500.0)], after=1)["rss_slope_mb_per_h"] is None
