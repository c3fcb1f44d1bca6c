"""When streams have frames, from the file's index alone: runs, gaps, and what is missing."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.recordings import BEGIN_NS, PERIOD_NS, SESSION, picture, raw, record

from foveacam_pipeline.capture.recording import index
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder
from foveacam_pipeline.capture.recording.tracks import MOST_RUNS, track_of
from foveacam_pipeline.capture.recording.values import TrackedBox
from foveacam_server.resources.capturing.recordings.documents import tracks_document

MS = 1_000_000


def times(*numbers: int, period_ms: int = 20) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.array(numbers, dtype=np.int64) * period_ms * MS


def test_a_stream_that_never_stopped_is_one_run() -> None:
    track = track_of(times(*range(100)))

    assert (track.count, track.period_ns) == (100, 20 * MS)
    assert track.runs_ns.tolist() == [[0, 99 * 20 * MS]]
    assert len(track.drops_ns) == 0


def test_a_long_interval_is_a_gap_and_a_short_one_lacks_frames() -> None:
    track = track_of(times(*range(10), 11, *range(13, 20), *range(100, 110)))

    assert track.runs_ns.tolist() == [[0, 380 * MS], [2000 * MS, 2180 * MS]]
    assert track.drops_ns.tolist() == [[180 * MS, 220 * MS], [220 * MS, 260 * MS]]
    assert track.dropped.tolist() == [1, 1]


def test_a_stream_without_a_period_lacks_nothing() -> None:
    rng = np.random.default_rng(5)
    track = track_of(np.cumsum(rng.integers(5, 60, 200) * MS))

    assert len(track.runs_ns) == 1
    assert len(track.dropped) == 0


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_frames_have_no_period(count: int) -> None:
    track = track_of(times(*range(count)))

    assert (track.count, track.period_ns, len(track.runs_ns)) == (count, None, count)


def test_of_very_many_gaps_the_longest_are_told() -> None:
    begins = np.cumsum(np.arange(3000) + 1) * 1000 * MS
    track = track_of(np.sort(np.concatenate([begins + tick * MS for tick in range(10)])))

    assert len(track.runs_ns) == MOST_RUNS
    assert track.runs_ns[-1, 0] == begins[-1]


def test_a_box_is_shown_near_its_own_moment_alone(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        recorder.publish("left", raw(picture("left", 0), tick=0))
        recorder.publish_box(TrackedBox(slot="A", t_ns=BEGIN_NS, bbox_px=(1.0, 2.0, 3.0, 4.0)))

    with Recording(tmp_path / "a.fcap") as recording:
        shown = {
            late_ms: len(recording.boxes(BEGIN_NS + late_ms * MS, within_ns=100 * MS))
            for late_ms in (-150, -50, 0, 50, 150)
        }
    assert shown == {-150: 0, -50: 1, 0: 1, 50: 1, 150: 0}


def test_a_recording_has_a_track_a_stream_with_telemetry_and_boxes(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        for tick in (0, 1, 2, 3, 40, 41, 43, 44):
            for stream in ("left", "center"):
                recorder.publish(stream, raw(picture(stream, tick), tick=tick))
            box = TrackedBox(slot="A", t_ns=BEGIN_NS + tick * PERIOD_NS, bbox_px=(1.0, 2.0, 3.0, 4.0))
            recorder.publish_box(box)

    with Recording(tmp_path / "a.fcap") as recording:
        found = tracks_document(recording)
        counted = tracks_document(recording, whole={"left"})

    named = {track.name: track for track in found.tracks}
    assert list(named) == ["center", "left", "A", "telemetry"]
    assert [named[name].kind for name in named] == ["frames", "frames", "boxes", "telemetry"]
    assert [named[name].role for name in named] == ["wide", "left", None, None]
    assert named["left"].runs == [(0.0, 0.06), (0.8, 0.88)]
    assert named["left"].drops == [(0.82, 0.86, 1)]
    assert {track.name: track.drops for track in counted.tracks}["left"] == []
    assert (named["A"].count, named["telemetry"].count) == (8, 16)
    assert found.recorded == SESSION.timestamp
    json.dumps(found.as_json(), allow_nan=False)


def test_opening_reads_nothing_of_the_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The chunks of frames and their indexes are not touched: the summary tells where and when they are."""

    def refuse(*_: object) -> None:
        raise AssertionError("a chunk was read")

    record(tmp_path / "a.fcap")
    monkeypatch.setattr(index, "_indexed_messages", refuse)
    monkeypatch.setattr(index, "chunk_records", refuse)
    with Recording(tmp_path / "a.fcap") as recording:
        assert {track.count for track in tracks_document(recording).tracks} == {6, 18}
        monkeypatch.undo()
        np.testing.assert_array_equal(recording.frame("left", 4).image, picture("left", 4))
