"""Recordings as jobs over a rig of plain Python: beside other work, to their end, on disks that fail."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.support.devices.fake_rig import FakeRig, Pictures
from tests.support.scenes.recordings import SmallDisk, record

from foveacam_hardware.contract import (
    Busy,
    CameraSettings,
    Frame,
    InvalidInput,
    MonotonicClock,
    OutOfRange,
    Role,
)
from foveacam_pipeline.capture.recording.bounds import DEFAULT_S, EndCause, RecordingBounds
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.session import RigDescription
from foveacam_pipeline.capture.recording.values import TrackedBox
from foveacam_pipeline.storage.free_space import RESERVE_BYTES
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job, JobState
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.store import Document, Store
from foveacam_server.resources.calibrating.calibrations.service import CalibrationService
from foveacam_server.resources.capturing.recordings.begin import check_room, full_rates
from foveacam_server.resources.capturing.recordings.live import LiveRecording
from foveacam_server.resources.capturing.recordings.schema import FilmRequest, RecordingRequest
from foveacam_server.resources.capturing.recordings.service import RecordingService, RecordingTools
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.frame_tap import FrameTap
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.live_views import LiveRates

PATIENCE_S = 60.0
RATES = LiveRates(wide_hz=100.0, fovea_hz=60.0)


class Bench:
    """A server's recordings on a fake rig."""

    def __init__(self, folder: Path, limits: LiveRates = RATES) -> None:
        self.free_bytes = 1 << 40
        self.store = Store(folder)
        self.events = EventLog(self.store)
        clock = MonotonicClock()
        self.rig = FakeRig(clock)
        hub = FrameHub(clock=clock)
        tap = FrameTap(hub)
        self.hardware = HardwareThread(
            lambda: self.rig, sink=tap, events=self.events, clock=clock, overlay=lambda _: None, limits=limits
        )
        self.jobs = JobRunner(self.store, events=self.events, clock=clock)
        calibration = CalibrationService(chosen=None, folder=folder / "calibrations", events=self.events)
        tools = RecordingTools(
            hardware=self.hardware,
            calibration=calibration,
            jobs=self.jobs,
            tap=tap,
            hub=hub,
            rates=limits,
            backends=DepthBackendService(folder / "networks", events=self.events),
            events=self.events,
            clock=clock,
            free_bytes=lambda _: self.free_bytes,
        )
        self.recordings = RecordingService(folder / "recordings", tools)
        self.jobs.handle("other", self._other)
        self.began, self.go = threading.Event(), threading.Event()
        self.hardware.start()
        assert self.hardware.wait_open(PATIENCE_S)
        self.jobs.start()

    def close(self) -> None:
        self.go.set()
        self.jobs.close()
        self.hardware.close()
        self.recordings.close()
        self.events.close()
        self.store.close()

    def begin(self, name: str = "one", **more: object) -> tuple[Job, str]:
        job = self.recordings.start(RecordingRequest.model_validate({"name": name, **more}))
        return job, job.id.replace("job-", "rec-")

    def until(self, recording_id: str, enough: Callable[[Document], bool]) -> Document:
        waiting = threading.Event()
        for _ in range(round(PATIENCE_S / 0.01)):
            document = self.recordings.get(recording_id).model_dump()
            if enough(document):
                return document
            waiting.wait(0.01)
        raise AssertionError(document)

    def ended(self, job: Job) -> Job:
        waiting = threading.Event()
        for _ in range(round(PATIENCE_S / 0.01)):
            found = self.jobs.get(job.id)
            if found.state.ended:
                return found
            waiting.wait(0.01)
        raise AssertionError(found)

    def _other(self, context: JobContext) -> str:
        self.began.set()
        assert self.go.wait(PATIENCE_S)
        return ""


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    found = Bench(tmp_path)
    yield found
    found.close()


def some(document: Document) -> bool:
    return all(stream["frames"] >= 2 for stream in document["streams"])


def test_it_records_while_another_job_has_the_worker_and_after_the_stop(bench: Bench) -> None:
    other = bench.jobs.submit("other")
    assert bench.began.wait(PATIENCE_S)
    job, recording_id = bench.begin()
    bench.until(recording_id, some)
    bench.jobs.cancel_all("the stop was engaged")
    assert bench.jobs.get(job.id).state is JobState.RUNNING
    assert bench.jobs.get(other.id).state is JobState.CANCELLING
    with pytest.raises(Busy, match="stop it first"):
        bench.begin("two")
    with pytest.raises(Busy):
        bench.recordings.remove(recording_id)

    found = bench.recordings.stop(recording_id).model_dump()

    assert (found["state"], found["ended"], found["why"]) == ("complete", EndCause.STOPPED, "")
    assert bench.ended(job).state is JobState.SUCCEEDED
    for stream in found["streams"]:
        assert stream["published"] == stream["written"] == stream["frames"] >= 2


@pytest.mark.parametrize("read_only", [False, True])
def test_a_disk_that_takes_no_more_ends_it_with_a_problem_and_what_it_took_is_read(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, read_only: bool
) -> None:
    def small(path: Path) -> SmallDisk:
        return SmallDisk(path, room=20_000, read_only=read_only)

    monkeypatch.setattr("foveacam_pipeline.capture.recording.recorder.new_recording_file", small)
    job, recording_id = bench.begin()
    ended = bench.ended(job)
    found = bench.recordings.get(recording_id).model_dump()

    assert ended.state is JobState.FAILED
    assert ended.problem is not None
    assert "the disk took no more" in ended.problem.detail
    assert (found["state"], found["playable"]) == ("truncated" if read_only else "partial", True)
    assert "the disk took no more" in found["why"]
    assert found["ended"] is EndCause.FAILED
    for stream in found["streams"]:
        assert stream["published"] == stream["written"] + stream["dropped"]
        assert stream["written"] == stream["frames"]
        assert stream["losses"].keys() <= {"disk", "queue"}  # what waits is bounded
    with Recording(bench.recordings.collection.folder / "one.fcap") as recording:
        assert len(list(recording.frames())) == sum(stream["frames"] for stream in found["streams"])


def test_a_disk_without_room_for_its_beginning_leaves_nothing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "foveacam_pipeline.capture.recording.recorder.new_recording_file",
        lambda path: SmallDisk(path, room=100),
    )
    job, recording_id = bench.begin()

    assert bench.ended(job).state is JobState.FAILED
    assert list(bench.recordings.collection.folder.iterdir()) == []
    with pytest.raises(NotFound):
        bench.recordings.get(recording_id)


def test_a_cancelled_job_keeps_what_was_recorded_and_says_that_it_was_cancelled(bench: Bench) -> None:
    job, recording_id = bench.begin(roles=["left"])
    bench.recordings.edit(recording_id, label="half")
    bench.until(recording_id, some)
    bench.jobs.cancel(job.id)

    assert bench.ended(job).state is JobState.CANCELLED
    found = bench.recordings.get(recording_id).model_dump()
    assert (found["state"], found["why"], found["label"]) == ("partial", "the job was cancelled", "half")
    assert found["ended"] is EndCause.CANCELLED


def test_a_disk_that_comes_to_its_reserve_ends_it_soundly_and_says_so(bench: Bench) -> None:
    job, recording_id = bench.begin()
    bench.until(recording_id, some)
    bench.free_bytes = RESERVE_BYTES - 1

    assert bench.ended(job).state is JobState.SUCCEEDED
    found = bench.recordings.get(recording_id).model_dump()
    assert (found["state"], found["ended"]) == ("complete", EndCause.DISK_RESERVE)
    assert "down to the 537 MB that are kept free" in found["why"]
    with Recording(bench.recordings.collection.folder / "one.fcap") as recording:
        assert recording.finalized
        assert len(list(recording.frames())) == sum(stream["frames"] for stream in found["streams"])


def test_a_start_with_less_than_the_reserve_is_refused_with_both_figures(bench: Bench) -> None:
    bench.free_bytes = RESERVE_BYTES - 1_000_000
    with pytest.raises(OutOfRange, match=r"537 MB that are kept free .* 536 MB are free") as refused:
        bench.begin()
    assert refused.value.found == "535870912 bytes"
    assert list(bench.recordings.collection.folder.iterdir()) == []


def test_a_recording_for_which_nobody_gave_a_time_says_when_it_ends(bench: Bench) -> None:
    job, recording_id = bench.begin()
    asked = job.describe().progress.as_json()
    found = bench.until(recording_id, lambda document: document["room_s"] is not None)
    bench.recordings.stop(recording_id)

    assert asked["total"] == DEFAULT_S
    assert "ends by itself after 300 s" in asked["note"]
    assert found["asked_s"] == DEFAULT_S
    assert DEFAULT_S - PATIENCE_S < found["left_s"] < DEFAULT_S
    assert found["room_bytes"] == bench.free_bytes - RESERVE_BYTES
    assert found["room_s"] > 0.0


def test_a_film_that_a_killed_server_left_unfinished_is_cleared_at_the_next_start(tmp_path: Path) -> None:
    films = tmp_path / "recordings" / ".films" / "rec-1"
    films.mkdir(parents=True)
    left, whole = films / ".wide-00.part.mp4", films / "wide-11.mp4"
    left.touch()
    whole.touch()
    Bench(tmp_path).close()
    assert list(films.iterdir()) == [whole]


def test_a_recording_ends_at_the_time_that_was_asked_for(bench: Bench) -> None:
    job, recording_id = bench.begin(duration_s=0.2)
    bench.ended(job)
    found = bench.recordings.get(recording_id).model_dump()
    assert (found["state"], found["ended"], found["why"]) == ("complete", EndCause.DURATION, "")
    frames = sum(stream["frames"] for stream in found["streams"])
    assert str(job.describe().progress.as_json()["note"]).startswith(f"{frames} frames, 0 dropped")


def test_a_recording_that_is_being_made_is_not_played(bench: Bench) -> None:
    _, recording_id = bench.begin()
    with pytest.raises(Busy, match="still being made"):
        bench.recordings.readable(recording_id)
    bench.recordings.stop(recording_id)
    assert bench.recordings.readable(recording_id).name == "one"


def frame(seq: int, *, t_ns: int) -> Frame:
    image = np.full((4, 6), seq, np.uint8)
    return Frame(image=image, role=Role.LEFT, seq=seq, t_ns=t_ns, exposure_ns=1)


class Published:
    """Stands in for a recorder; `failure` is raised instead."""

    failure: Exception | None = None

    def __init__(self) -> None:
        self.seqs: list[int] = []
        self.boxes: list[TrackedBox] = []

    def publish_box(self, box: TrackedBox) -> bool:
        self.boxes.append(box)
        return True

    def publish(self, stream: str, raw: Frame) -> bool:
        if self.failure is not None:
            raise self.failure
        self.seqs.append(raw.seq)
        return True


@pytest.fixture
def live(tmp_path: Path) -> LiveRecording:
    rig = RigDescription(rig_id="fake", name="Fake rig", baseline_m=0.2)
    return LiveRecording(
        id="rec-1", job_id="job-1", path=tmp_path / "a.fcap", roles=(Role.LEFT,), rig=rig, label="",
        bounds=RecordingBounds(longest_s=1.0, free_bytes=lambda: 1 << 40), every=True, begun_ns=0,
        boxes=lambda shown: [TrackedBox(slot="target", t_ns=shown.t_ns, bbox_px=(1.0, 2.0, 3.0, 4.0))],
    )  # fmt: skip


def test_a_frame_that_is_shown_twice_is_recorded_once_and_one_not_asked_for_not_at_all(
    live: LiveRecording,
) -> None:
    recorder = Published()
    live.recorder = recorder  # type: ignore[assignment]  # counts what a recorder is given
    shown = Pictures(watching=set())
    tap = FrameTap(shown)
    with tap.listening(live.roles, live.record_frame):
        assert (tap.watched("left"), tap.watched("wide")) == (True, False)
        for one in (frame(1, t_ns=10), frame(1, t_ns=10), frame(2, t_ns=20)):
            tap.publish_frame(one)
        tap.publish_frame(
            Frame(image=np.zeros((4, 6), np.uint8), role=Role.WIDE, seq=1, t_ns=30, exposure_ns=1)
        )
    tap.publish_frame(frame(3, t_ns=40))

    assert recorder.seqs == [1, 2]
    assert shown.counts == {"left": 4, "wide": 1}
    assert not tap.watched("left")


def test_the_boxes_of_followed_targets_are_recorded_with_the_wide_frames_alone(live: LiveRecording) -> None:
    recorder = Published()
    live.recorder = recorder  # type: ignore[assignment]  # counts what a recorder is given
    live.record_frame(frame(1, t_ns=10))
    live.record_frame(Frame(image=np.zeros((4, 6), np.uint8), role=Role.WIDE, seq=1, t_ns=30, exposure_ns=1))
    assert [(box.slot, box.t_ns) for box in recorder.boxes] == [("target", 30)]


@pytest.mark.parametrize("every", [True, False])
def test_who_records_all_frames_of_a_camera_is_told_from_who_records_what_is_shown(every: bool) -> None:
    tap = FrameTap(Pictures(watching=set()))
    with tap.listening([Role.LEFT], lambda _: None, every=every):
        assert (tap.wants_every("left"), tap.wants_every("wide")) == (every, False)
        assert tap.watched("left")
    assert not tap.wants_every("left")


def test_full_rate_is_the_rigs_own_whatever_limits_the_live_views(tmp_path: Path) -> None:
    bench = Bench(tmp_path, limits=LiveRates(wide_hz=0.5, fovea_hz=0.5))
    try:
        _, shown_id = bench.begin("shown", rate="live")
        bench.until(shown_id, lambda found: found["duration_s"] > 0.5)
        shown = bench.recordings.stop(shown_id).model_dump()
        _, whole_id = bench.begin("whole")
        whole = bench.until(whole_id, lambda found: all(one["frames"] >= 20 for one in found["streams"]))
        bench.recordings.stop(whole_id)
    finally:
        bench.close()

    assert all(stream["frames"] <= 2 for stream in shown["streams"])
    assert whole["duration_s"] < 20 / 0.5 / 2  # the limits would have let it take 40 s


def test_an_error_at_a_frame_ends_the_recording_not_the_thread_of_the_cameras(live: LiveRecording) -> None:
    recorder = Published()
    recorder.failure = ValueError("no such format")
    live.recorder = recorder  # type: ignore[assignment]  # fails at every frame
    live.record_frame(frame(1, t_ns=10))

    assert live.failure is not None
    assert "camera left cannot be recorded (no such format)" in str(live.failure)


def test_a_disk_that_is_too_small_is_refused_with_both_figures() -> None:
    frames = [(1_000_000, 10.0), (500_000, 20.0)]
    check_room(frames, duration_s=10.0, free_bytes=RESERVE_BYTES + 200_000_000)
    with pytest.raises(OutOfRange, match=r"737 MB are needed, .* 737 MB are free") as refused:
        check_room(frames, duration_s=10.0, free_bytes=RESERVE_BYTES + 199_999_999)
    assert (refused.value.asked, refused.value.found) == ("736870912 bytes", "736870911 bytes")


def test_a_name_that_is_taken_is_refused_before_anything_begins(bench: Bench) -> None:
    _, recording_id = bench.begin()
    bench.recordings.stop(recording_id)
    with pytest.raises(InvalidInput, match="already"):
        bench.begin("ONE")


def test_numbered_compressed_and_packed_as_asked(bench: Bench) -> None:
    assert bench.recordings.name_of("walk", numbered=True).name == "walk 0001"
    for number in (1, 2):
        _, recording_id = bench.begin("walk", numbered=True, compress=True, packed=True)
        bench.until(recording_id, some)
        assert bench.recordings.stop(recording_id).name == f"walk 000{number}"
    with Recording(bench.recordings.collection.folder / "walk 0002.fcap") as recording:
        assert all(stream.form.compressed for stream in recording.streams.values())

    found = bench.recordings.name_of("walk 0002", numbered=False)
    assert (found.free, "already" in found.why) == (False, True)


def test_a_search_finds_those_that_contain_all_of_its_words(bench: Bench) -> None:
    for name in ("desk at noon", "desk at night", "street at night"):
        record(bench.recordings.collection.folder / f"{name}.fcap", ticks=1)

    found = {known.name for known in bench.recordings.search(text="Night desk")}
    assert found == {"desk at night"}
    assert len(bench.recordings.search(text="  ")) == 3


def test_the_rate_of_looks_is_that_of_the_longer_exposure() -> None:
    rig = FakeRig(MonotonicClock())
    for right_ms in (6, 10):
        rig.right.settings = CameraSettings(exposure_ns=right_ms * 1_000_000)
        longer_ms = max(8, right_ms)  # the left one has 8 ms
        assert full_rates(rig).fovea_hz == pytest.approx(1000.0 / (14 + longer_ms))


def test_a_cancelled_export_leaves_nothing(bench: Bench) -> None:
    recordings = bench.recordings
    record(recordings.collection.folder / "long.fcap", ticks=3000)
    (known,) = recordings.search()
    job = recordings.films.start(known.id, FilmRequest(show="wide", fps=240.0, format="av1"))
    waiting = threading.Event()
    while bench.jobs.get(job.id).describe().progress.done == 0:
        waiting.wait(0.005)

    bench.jobs.cancel(job.id)

    assert bench.ended(job).state is JobState.CANCELLED
    assert list(recordings.collection.films(known.id).iterdir()) == []
