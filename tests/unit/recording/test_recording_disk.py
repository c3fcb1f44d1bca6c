"""What a recorder counts, and how it ends on disks that fail or are slow."""

import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.recordings import SESSION, STREAMS, SmallDisk, picture, raw

from foveacam_hardware.contract import StorageFull, Timeout
from foveacam_pipeline.capture.recording.disk import Buffer, FileDisk
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.statistics import FrameLoss, StreamStatistics

TICKS = 20


class HeldDisk(FileDisk):
    """Takes nothing of a frame until it is let go."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.writing = threading.Event()
        self.go = threading.Event()

    def append(self, buffers: Sequence[Buffer]) -> None:
        if len(buffers) > 3:  # a chunk
            self.writing.set()
            assert self.go.wait(20.0)
        super().append(buffers)


def publish_all(recorder: Recorder) -> None:
    for tick in range(TICKS):
        for stream in STREAMS:
            recorder.publish(stream, raw(picture(stream, tick), tick=tick))


def check_sums(counts: dict[str, StreamStatistics]) -> None:
    for found in counts.values():
        assert found.waiting == 0
        assert found.published == found.written + found.dropped == TICKS


@pytest.mark.parametrize("room", [8_000, 20_000, 31_234, 45_000])
def test_a_full_disk_ends_it_with_the_reason_and_a_whole_file(tmp_path: Path, room: int) -> None:
    disk = SmallDisk(tmp_path / "a.fcap", room=room)
    recorder = Recorder(tmp_path / "a.fcap", SESSION, disk=disk)
    publish_all(recorder)
    with pytest.raises(StorageFull, match="the disk is full"):
        recorder.close()

    counts = recorder.statistics
    check_sums(counts)
    assert (tmp_path / "a.fcap").stat().st_size <= room
    assert sum(found.losses[FrameLoss.DISK] for found in counts.values()) > 0
    with Recording(tmp_path / "a.fcap") as recording:
        assert (recording.truncation, recording.finalized) == (None, False)
        for stream, found in recording.streams.items():
            assert len(found) == counts[stream].written
        for frame in recording.frames():
            np.testing.assert_array_equal(frame.image, picture(frame.stream, frame.seq))


def test_a_disk_that_turns_read_only_leaves_what_it_took(tmp_path: Path) -> None:
    disk = SmallDisk(tmp_path / "a.fcap", room=20_000, read_only=True)
    recorder = Recorder(tmp_path / "a.fcap", SESSION, disk=disk)
    publish_all(recorder)
    with pytest.raises(StorageFull, match="Read-only"):
        recorder.close()

    check_sums(recorder.statistics)
    with Recording(tmp_path / "a.fcap") as recording:
        assert recording.truncation is not None
        assert len(list(recording.frames())) == sum(found.written for found in recorder.statistics.values())


def test_numbers_that_never_came_are_counted_beside_what_was_published(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        for tick in (4, 5, 9, 9, 10):
            recorder.publish("left", raw(picture("left", tick), tick=tick))

    found = recorder.statistics["left"].document()
    assert (found["published"], found["written"], found["missing"]) == (5, 5, 3)


def test_the_rate_of_a_stream_is_that_of_its_intervals() -> None:
    found = StreamStatistics()
    for tick in range(5):
        found = found.with_published(tick).with_written(100, t_ns=tick * 20_000_000)
    assert found.fps == pytest.approx(50.0)
    assert StreamStatistics().with_published(0).with_written(100, t_ns=0).fps == 0.0


def test_a_disk_without_room_for_the_beginning_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(StorageFull, match="nothing was recorded"):
        Recorder(tmp_path / "a.fcap", SESSION, disk=SmallDisk(tmp_path / "a.fcap", room=100))


def test_what_finds_the_ring_full_is_counted_as_dropped_by_the_queue(tmp_path: Path) -> None:
    disk = HeldDisk(tmp_path / "a.fcap")
    recorder = Recorder(tmp_path / "a.fcap", SESSION, options=RecordingOptions(ring_frames=5), disk=disk)
    recorder.publish("left", raw(picture("left", 0), tick=0))
    assert disk.writing.wait(20.0)
    taken = [recorder.publish("left", raw(picture("left", tick), tick=tick)) for tick in range(1, TICKS)]
    assert recorder.statistics["left"].waiting == 6
    disk.go.set()
    recorder.close()

    assert taken == [True] * 5 + [False] * (TICKS - 6)
    check_sums(recorder.statistics)
    assert recorder.statistics["left"].losses == {FrameLoss.QUEUE: TICKS - 6}
    with Recording(tmp_path / "a.fcap") as recording:
        assert [frame.seq for frame in recording.frames()] == [0, 1, 2, 3, 4, 5]


def test_what_comes_after_the_end_or_in_another_format_is_counted(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.fcap", SESSION)
    recorder.publish("left", raw(picture("left", 0), tick=0))
    recorder.publish("left", raw(picture("left", 1, width=16), tick=1))
    recorder.close()
    recorder.publish("left", raw(picture("left", 2), tick=2))

    found = recorder.statistics["left"]
    assert (found.published, found.written) == (3, 1)
    assert found.losses == {FrameLoss.FORMAT: 1, FrameLoss.CLOSED: 1}


def test_a_disk_that_does_not_answer_is_not_waited_for_for_ever(tmp_path: Path) -> None:
    disk = HeldDisk(tmp_path / "a.fcap")
    recorder = Recorder(tmp_path / "a.fcap", SESSION, options=RecordingOptions(finish_s=-0.95), disk=disk)
    recorder.publish("left", raw(picture("left", 0), tick=0))
    assert disk.writing.wait(20.0)
    recorder.publish("left", raw(picture("left", 1), tick=1))
    with pytest.raises(Timeout, match="has not answered"):
        recorder.close()
    disk.go.set()
    recorder._thread.join(20.0)

    assert recorder.statistics["left"].losses == {FrameLoss.DEADLINE: 1}
    with Recording(tmp_path / "a.fcap") as recording:
        assert (len(recording.stream("left")), recording.finalized) == (1, False)


def test_a_recording_that_an_error_ended_is_whole_and_does_not_say_that_it_ended_as_meant(
    tmp_path: Path,
) -> None:
    with pytest.raises(KeyError), Recorder(tmp_path / "a.fcap", SESSION) as recorder:
        publish_all(recorder)
        raise KeyError

    with Recording(tmp_path / "a.fcap") as recording:
        assert (recording.truncation, recording.finalized) == (None, False)
        assert len(list(recording.frames())) == TICKS * len(STREAMS)


def test_an_error_in_the_body_is_not_hidden_by_that_of_the_disk(tmp_path: Path) -> None:
    disk = SmallDisk(tmp_path / "a.fcap", room=8_000)
    with pytest.raises(KeyError), Recorder(tmp_path / "a.fcap", SESSION, disk=disk) as recorder:
        publish_all(recorder)
        raise KeyError
