"""The bench of faults against the real thing: a few kills and a few broken lines, in real time."""

from statistics import median

import pytest

from foveacam_bench.faults import all_kinds, kills, serial_line
from foveacam_bench.faults.tally import FaultTally

pytestmark = pytest.mark.timeout(300)


def test_killed_hosts_and_servers_leave_parked_mirrors_within_a_second() -> None:
    tally = FaultTally()

    figures = kills.measure(tally, True)

    assert figures["parked"] == figures["kills"] == 2
    assert 0 < figures["parked_max_s"] <= 1.0
    assert tally.figures()["hangs"] == tally.limit_violations == 0


def test_broken_lines_are_noticed_and_all_is_well_again_without_a_restart() -> None:
    tally = FaultTally()

    serial_line.measure(tally, True)

    figures = tally.figures()
    assert figures["sequences"] == len(serial_line.QUICK_NUMBERS)
    assert {"line_silence", "line_stop", "line_cut"} <= set(tally.kinds)
    assert tally.faults > tally.absorbed
    assert (figures["hangs"], figures["unparked"], figures["limit_violations"]) == (0, 0, 0)
    assert median(tally.detected_s) <= 2.0  # each within the bench's own patience, or it were a hang
    assert median(tally.recovered_s) <= 8.0


def test_lost_cameras_missing_cables_and_a_full_disk_are_noticed_and_all_is_well_again() -> None:
    tally = FaultTally()

    own = all_kinds.DEVICES(tally, True)

    figures = tally.figures()
    wanted = {"strobe_missing", "camera_unplugged", "trigger_missing", "disk_full"}
    if own["gige_camera"]:
        wanted |= {"camera_killed", "camera_stopped"}
    assert set(tally.kinds) == wanted
    assert own["events_lost"] == 0
    assert figures["sequences"] == len(wanted)
    assert (figures["hangs"], figures["unparked"], figures["limit_violations"]) == (0, 0, 0)
    assert figures["absorbed"] == 0
    assert median(tally.detected_s) <= 3.0
    assert median(tally.recovered_s) <= 10.0
