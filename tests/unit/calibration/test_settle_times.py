"""The settle time that was measured and put in use: kept, restored at a start, or passed over."""

from contextlib import closing
from pathlib import Path

import pytest
from tests.support.devices.fake_rig import FakeRig
from tests.support.devices.hardware_setup import hardware_setup

from foveacam_hardware.contract import NotCalibrated, StorageFull, VirtualClock
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.devices.settle_time.service import SettleTimeService
from foveacam_server.rig.settle_times import SettleTime, SettleTimes

MEASURED = SettleTime(
    rig_id="fake",
    settle_us=9_900,
    measured_utc="2026-02-01T10:00:00Z",
    session_id="ses-1",
    low_pass_hz=120,
)


@pytest.fixture
def times(tmp_path: Path) -> SettleTimes:
    return SettleTimes(tmp_path / "settle")


def restored(times: SettleTimes, folder: Path) -> tuple[FakeRig, SettleTimeService]:
    """Return a rig that was opened anew, and the desk that gave it what is in use."""
    rig = FakeRig(VirtualClock())
    with Store(folder / "data") as store:
        events = EventLog(store)
        desk = SettleTimeService(times, events=events)
        desk.restore(rig)
        events.close()
    return rig, desk


def test_rig_opens_with_what_was_measured_on_it(times: SettleTimes, tmp_path: Path) -> None:
    times.store(MEASURED)
    rig, desk = restored(times, tmp_path)
    assert rig.settle_us == MEASURED.settle_us
    assert desk.source == "measured 2026-02-01"


def test_rig_on_which_nothing_was_measured_keeps_its_files_settle_time(
    times: SettleTimes, tmp_path: Path
) -> None:
    times.store(MEASURED.model_copy(update={"rig_id": "another"}))
    rig, desk = restored(times, tmp_path)
    assert rig.settle_us == FakeRig.settle_us
    assert desk.source == "rig file"


def test_settle_time_of_another_drive_filter_is_passed_over(times: SettleTimes, tmp_path: Path) -> None:
    times.store(MEASURED.model_copy(update={"low_pass_hz": 600}))
    rig, desk = restored(times, tmp_path)
    assert rig.settle_us == FakeRig.settle_us
    assert desk.source == "rig file"


def test_settle_time_of_the_rig_before_does_not_count_for_another(times: SettleTimes, tmp_path: Path) -> None:
    times.store(MEASURED)
    another = FakeRig(VirtualClock())
    another.rig_id = "another"
    with Store(tmp_path / "data") as store, closing(EventLog(store)) as events:
        desk = SettleTimeService(times, events=events)
        for rig in (FakeRig(VirtualClock()), another):
            desk.restore(rig)
    assert desk.in_use is None
    assert desk.source == "rig file"


def test_settle_time_of_another_drive_filter_is_not_put_in_use(times: SettleTimes, tmp_path: Path) -> None:
    with hardware_setup(tmp_path / "data") as setup:
        hardware, desk = setup.start(), SettleTimeService(times, events=setup.events)
        with pytest.raises(NotCalibrated, match="600 Hz, now it is 120 Hz"):
            desk.apply(MEASURED.model_copy(update={"low_pass_hz": 600}), hardware)
        assert (setup.rig.settle_us, times.of("fake")) == (FakeRig.settle_us, None)
        desk.apply(MEASURED, hardware)
        assert (setup.rig.settle_us, times.of("fake")) == (MEASURED.settle_us, MEASURED)


def test_what_is_forgotten_is_not_restored_at_the_next_start(times: SettleTimes, tmp_path: Path) -> None:
    times.store(MEASURED)
    times.remove("another")
    assert times.of("fake") == MEASURED
    times.remove("fake")
    times.remove("fake")
    rig, desk = restored(times, tmp_path)
    assert (rig.settle_us, desk.source) == (FakeRig.settle_us, "rig file")


@pytest.mark.parametrize(
    "content",
    [
        "",
        "[]",
        "{",
        '{"format": "other", "version": 1}',
        '{"format": "foveacam-settle-time", "version": 1, "settle_us": -4}',
    ],
)
def test_damaged_file_leaves_the_rig_files_settle_time(
    times: SettleTimes, tmp_path: Path, content: str
) -> None:
    times.store(MEASURED)
    (tmp_path / "settle" / "fake.json").write_text(content)
    assert times.of("fake") is None


def test_newest_settle_time_counts_and_nothing_is_left_half_written(
    times: SettleTimes, tmp_path: Path
) -> None:
    times.store(MEASURED)
    times.store(MEASURED.model_copy(update={"settle_us": 8_000}))
    found = times.of("fake")
    assert found is not None
    assert found.settle_us == 8_000
    assert [path.name for path in (tmp_path / "settle").iterdir()] == ["fake.json"]


def test_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "settle").write_text("a file in the way")
    with pytest.raises(StorageFull, match=r"a settle time of .* ms in .*settle: the disk cannot be written"):
        SettleTimes(tmp_path / "settle").store(MEASURED)
