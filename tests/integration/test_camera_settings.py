"""Settings of cameras in the server: kept by serial number, compared as a pair, owed to one that was lost."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from foveacam_hardware.contract import (
    AutoMode,
    CameraRanges,
    CameraSettings,
    PixelFormat,
    Role,
    StorageFull,
    ValueRange,
)
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.devices.cameras.pair import differences
from foveacam_server.resources.devices.cameras.records import CameraRecord, CameraRecords
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.resources.devices.cameras.trigger_test import (
    TriggerProbe,
    TriggerVerdict,
    patience_ms,
    probe_by_pulse,
    put_back,
    verdict_of,
)

RANGES = CameraRanges(
    exposure_ns=ValueRange(low=30_000, high=1_000_000_000),
    gain_db=ValueRange(low=0.0, high=24.0),
    frame_rate_hz=ValueRange(low=0.1, high=228.0),
    black_level=ValueRange(low=0.0, high=32.0),
    pixel_formats=(PixelFormat.MONO8,),
)
SETTINGS = CameraSettings(exposure_ns=8_000_000)
SERIAL = "rtsp://10.0.0.2:554/stream/../../etc"


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with open_simulated(inline=True) as opened:
        opened.mirrors.enable()
        yield opened


def desk(folder: Path) -> Iterator[CameraSettingsService]:
    with Store(folder) as store:
        events = EventLog(store)
        yield CameraSettingsService(CameraRecords(folder / "cameras"), events=events)
        events.close()


def differing(**change: object) -> list[str]:
    other = replace(SETTINGS, **change)  # type: ignore[arg-type]  # one of several types
    return [found.setting for found in differences(SETTINGS, other, ranges=RANGES)]


def test_what_is_kept_is_read_by_another_server(tmp_path: Path) -> None:
    kept = CameraRecord(serial=SERIAL, gain_db=3.0, pixel_format=PixelFormat.MONO12)
    CameraRecords(tmp_path).write(kept)

    assert CameraRecords(tmp_path).get(SERIAL) == kept
    assert CameraRecords(tmp_path).get("another") is None
    assert [path.parent for path in tmp_path.rglob("*.json")] == [tmp_path]  # a serial is no path


def test_what_is_forgotten_is_gone(tmp_path: Path) -> None:
    records = CameraRecords(tmp_path)
    records.write(CameraRecord(serial=SERIAL, gain_db=3.0))
    records.delete(SERIAL)
    records.delete(SERIAL)

    assert records.get(SERIAL) is None
    assert CameraRecords(tmp_path).get(SERIAL) is None


@pytest.mark.parametrize("content", ["", "[]", '{"format": "foveacam-camera-settings", "version": 9}', "{}"])
def test_a_damaged_record_is_passed_over(tmp_path: Path, content: str) -> None:
    CameraRecords(tmp_path).write(CameraRecord(serial="1", gain_db=3.0))
    next(tmp_path.glob("*.json")).write_text(content, encoding="utf-8")

    assert CameraRecords(tmp_path).get("1") is None


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "cameras").write_text("a file", encoding="utf-8")
    with pytest.raises(StorageFull, match=r"settings of camera 1 in .*cameras: the disk cannot be written"):
        CameraRecords(tmp_path / "cameras").write(CameraRecord(serial="1", gain_db=3.0))


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({}, []),
        ({"gain_db": 0.12}, []),  # 0.5 % of 24 dB
        ({"gain_db": 0.13}, ["gain_db"]),
        ({"exposure_ns": 8_070_000}, []),
        ({"exposure_ns": 8_100_000}, ["exposure_ms"]),  # no pulse exposes both: a head would not look
        ({"black_level": 0.2}, ["black_level"]),
        ({"pixel_format": PixelFormat.RGB8}, ["pixel_format"]),
        ({"triggered": True}, ["trigger"]),
        ({"frame_rate_hz": 100.0}, []),
        ({"frame_rate_auto": True}, []),
        ({"exposure_auto": AutoMode.CONTINUOUS}, ["exposure_auto"]),
    ],
)
def test_foveae_differ_beyond_half_a_percent_of_the_range(
    change: dict[str, object], found: list[str]
) -> None:
    assert differing(**change) == found


def test_foveae_that_both_expose_by_themselves_may_differ_in_it() -> None:
    both = [
        replace(SETTINGS, exposure_ns=exposure_ns, exposure_auto=AutoMode.CONTINUOUS)
        for exposure_ns in (8_000_000, 20_000_000)
    ]

    assert differences(*both, ranges=RANGES) == ()


def test_a_camera_that_was_lost_gets_what_it_is_owed_once_it_is_back(rig: Rig, tmp_path: Path) -> None:
    assert rig.truth is not None
    unplugged = rig.truth.world.faults.unplugged
    before = {Role.LEFT: rig.left.settings, Role.RIGHT: rig.right.settings}
    for cameras in desk(tmp_path):
        cameras.restore(rig)
        rig.left.configure(replace(rig.left.settings, triggered=False))
        unplugged.add(Role.LEFT)
        owed = put_back((rig.left, rig.right), before)
        cameras.restore_when_back(owed)
        cameras.restore(rig)
        assert not rig.left.settings.triggered
        unplugged.clear()
        rig.connect()
        cameras.restore(rig)

        assert list(owed) == [Role.LEFT]
        assert rig.left.settings == before[Role.LEFT]


FRAME, SILENT, REFUSED = (
    TriggerProbe(took_ms=9.0),
    TriggerProbe(why="nothing came"),
    TriggerProbe(why="it cannot", possible=False),
)


@pytest.mark.parametrize(
    ("software", "hardware", "verdict"),
    [
        (FRAME, FRAME, TriggerVerdict.OK),
        (REFUSED, FRAME, TriggerVerdict.OK),
        (FRAME, None, TriggerVerdict.SOFTWARE_ONLY),
        (FRAME, REFUSED, TriggerVerdict.SOFTWARE_ONLY),
        (FRAME, SILENT, TriggerVerdict.WIRING),
        (FRAME, TriggerProbe(took_ms=9.0, why="no strobe"), TriggerVerdict.WIRING),
        (SILENT, SILENT, TriggerVerdict.CAMERA),
        (SILENT, None, TriggerVerdict.CAMERA),
        (REFUSED, SILENT, TriggerVerdict.WIRING),
        (REFUSED, None, TriggerVerdict.NO_PROBE),
        (REFUSED, REFUSED, TriggerVerdict.NO_PROBE),
    ],
)
def test_both_probes_together_make_the_verdict(
    software: TriggerProbe, hardware: TriggerProbe | None, verdict: TriggerVerdict
) -> None:
    assert verdict_of(Role.LEFT, software, hardware).verdict is verdict


def test_without_a_controller_no_pulse_can_be_given(rig: Rig) -> None:
    rig.mirrors.close()
    try:
        assert probe_by_pulse(rig, (rig.left, rig.right), gaze=rig.mirrors.state.volts) is None
    finally:
        rig.connect()
        rig.mirrors.enable()


def test_a_long_exposure_is_waited_for() -> None:
    assert patience_ms(SETTINGS) == 1000.0
    assert patience_ms(replace(SETTINGS, exposure_ns=2_000_000_000)) == 4500.0
