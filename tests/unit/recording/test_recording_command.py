"""`foveacam record` and `foveacam recording`: what they make and say, and one line for what is refused."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests.support.scenes.memory_recording import MemoryRecording
from tests.support.scenes.recordings import record

from foveacam_hardware.contract import InvalidInput, OutOfRange, VirtualClock
from foveacam_hardware.rig_replay import replay_rig
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.storage.free_space import RESERVE_BYTES
from foveacam_server import cli
from foveacam_server.resources.capturing.recordings.cli_record import RecordingSpec, record_opened

START_NS = 1_000_000_000


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FOVEACAM_DATA", str(tmp_path / "data"))


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["foveacam", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert isinstance(ended.value.code, int)
    return ended.value.code


def test_a_rig_is_recorded_look_by_look_with_the_volts_of_each(tmp_path: Path) -> None:
    told: list[str] = []
    with replay_rig(MemoryRecording(), clock=VirtualClock(START_NS)) as rig:
        wish = RecordingSpec(file=tmp_path / "a.fcap", seconds=0.3)
        found = record_opened(rig, wish, calibration=None, report=lambda _, words: told.append(words))

    assert set(found.streams) == {"left", "center", "right"}
    assert all(counts.written == counts.published for counts in found.streams.values())
    assert all((counts.written or 0) > 4 for counts in found.streams.values())
    assert "0 dropped" in told[-1]
    with Recording(tmp_path / "a.fcap") as recording:
        assert recording.rig is not None and recording.rig.rig_id == "played"
        for frame in recording.frames(["left", "right"]):
            assert frame.pose.volts is not None
            assert frame.pose.volts.x_v == float(frame.image[0, 0])
            assert (frame.pose.volts_source, frame.pose.exposure_ns) == ("fin-averaged", 2_000_000)


def test_ctrl_c_ends_a_recording_early_and_well(tmp_path: Path) -> None:
    def interrupt(done_s: float, _words: str) -> None:
        if done_s > 0.05:
            raise KeyboardInterrupt

    with replay_rig(MemoryRecording(), clock=VirtualClock(START_NS)) as rig:
        found = record_opened(
            rig, RecordingSpec(file=tmp_path / "a.fcap", seconds=9.0), calibration=None, report=interrupt
        )
    assert found.ended == "stopped"
    with Recording(tmp_path / "a.fcap") as recording:
        assert recording.finalized
        assert 1 < len(recording.stream("left")) < 10


def test_a_disk_that_comes_to_its_reserve_ends_a_recording_soundly_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    free = [RESERVE_BYTES + 3]

    def less(_folder: Path) -> int:
        free[0] -= 1
        return free[0]

    monkeypatch.setattr("foveacam_server.resources.capturing.recordings.cli_record.free_bytes", less)
    with replay_rig(MemoryRecording(), clock=VirtualClock(START_NS)) as rig:
        wish = RecordingSpec(file=tmp_path / "a.fcap", seconds=9.0)
        found = record_opened(rig, wish, calibration=None, report=lambda *_: None)
        with pytest.raises(OutOfRange, match="MB that are kept free"):
            record_opened(
                rig, replace(wish, file=tmp_path / "b.fcap"), calibration=None, report=lambda *_: None
            )

    assert found.ended == "disk_reserve"
    assert "what was recorded is whole" in found.why
    with Recording(tmp_path / "a.fcap") as recording:
        assert recording.finalized
        assert 1 <= len(recording.stream("left")) < 5
    assert not (tmp_path / "b.fcap").exists()


def test_a_direction_needs_a_calibration(tmp_path: Path) -> None:
    wish = RecordingSpec(file=tmp_path / "a.fcap", seconds=0.3, direction_deg=(1.0, 0.0))
    with (
        replay_rig(MemoryRecording(), clock=VirtualClock(START_NS)) as rig,
        pytest.raises(InvalidInput, match="needs a calibration"),
    ):
        record_opened(rig, wish, calibration=None, report=lambda *_: None)
    assert not (tmp_path / "a.fcap").exists()


def test_info_says_what_a_recording_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    record(tmp_path / "a.fcap")
    assert run(monkeypatch, "recording", "info", str(tmp_path / "a.fcap"), "--json") == 0
    told = json.loads(capsys.readouterr().out)

    assert (told["finalized"], told["truncated"], told["duration_s"]) == (True, None, 0.1)
    assert told["streams"]["center"]["frames"] == 6
    assert told["streams"]["center"]["role"] == "wide"


def test_info_of_one_that_was_cut_off_says_what_was_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.fcap"
    record(path)
    path.write_bytes(path.read_bytes()[:9000])
    monkeypatch.setenv("COLUMNS", "400")
    assert run(monkeypatch, "recording", "info", str(path)) == 0

    assert "cut off: the file ends before its recording does" in capsys.readouterr().out


def test_export_makes_a_film(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    record(tmp_path / "a.fcap")
    target = tmp_path / "a.mp4"
    order = ["recording", "export", str(tmp_path / "a.fcap"), str(target), "--codec", "mp4v", "--json"]
    assert run(monkeypatch, *order) == 0
    told = json.loads(capsys.readouterr().out)

    assert (told["shows"], told["frames"], told["codec"]) == ("center", 6, "mp4v")
    assert told["bytes"] == target.stat().st_size


@pytest.mark.parametrize(
    ("name", "more", "codec"),
    [
        ("a.mov", ["--codec", "prores"], "apcn"),
        ("a.mp4", ["--codec", "av1"], "av01"),
        ("a.mov", [], "apcn"),
        ("a.zip", [], "png"),
        ("a.npy", ["--show", "left", "--end-s", "0.05"], "npy"),
    ],
)
def test_the_suffix_or_the_codec_choose_the_format(
    name: str,
    more: list[str],
    codec: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    record(tmp_path / "a.fcap")
    order = ["recording", "export", str(tmp_path / "a.fcap"), str(tmp_path / name), *more, "--json"]
    assert run(monkeypatch, *order) == 0
    told = json.loads(capsys.readouterr().out)

    assert (told["codec"], told["frames"]) == (codec, 3 if codec == "npy" else 6)
    assert told["bytes"] == (tmp_path / name).stat().st_size > 0


@pytest.mark.parametrize(
    ("order", "why"),
    [
        (("record", "a.avi"), "end it in .fcap"),
        (("recording", "info", "none.fcap"), "there is no such file"),
        (("recording", "export", "none.fcap", "a.mp4", "--codec", "divx"), "there is no codec"),
        (("serve", "--replay", "none.fcap"), "there is no such file"),
    ],
)
def test_what_is_refused_is_told_in_one_line(
    order: tuple[str, ...], why: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, *order) == 2
    captured = capsys.readouterr()
    assert why in captured.err
    assert captured.err.count("\n") == 1
