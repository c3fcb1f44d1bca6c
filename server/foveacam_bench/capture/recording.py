"""Measure the writing rate of recordings against a bare loop of the same bytes, for `bench capture`.

Prepared frames of three cameras are recorded at 30 Hz, then as fast as the ring accepts them. For the ratio
both loops run on one core, so that other work on the machine slows both.
"""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_hardware.contract import MirrorVolts
from foveacam_pipeline.capture.recording.pixels import stream_format
from foveacam_pipeline.capture.recording.recorder import Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.session import RecordingSession
from foveacam_pipeline.capture.recording.statistics import StreamStatistics
from foveacam_pipeline.capture.recording.values import FramePose, RawFrame

HEIGHT, WIDTH, RATE_HZ = 1080, 1440, 30.0
STREAMS = ("left", "center", "right")
MEMORY = Path("/dev/shm")  # noqa: S108 - the limit is for a file system in memory
DIFFERENT = 4
"""Pictures of each stream: more would measure the speed of memory."""
RATIO_ROUNDS = 9
RATIO_FRAMES = 300
"""In each round; 470 MB."""


def measure_recording(*, quick: bool = False, folder: Path | None = None) -> Figures:
    """Return the figures; `quick`: 2 s at the cameras' rate instead of 20, one round instead of nine."""
    pictures = _pictures()
    where = folder or (MEMORY if MEMORY.is_dir() else Path(tempfile.gettempdir()))
    with tempfile.TemporaryDirectory(dir=where) as scratch:
        path = Path(scratch) / "bench.fcap"
        counts = _record_paced(path, pictures, seconds=2.0 if quick else 20.0)
        with _one_core():
            _write_rates(Path(scratch), pictures)  # the first use of memory pages is slow
            ratios = [_write_rates(Path(scratch), pictures) for _ in range(1 if quick else RATIO_ROUNDS)]
    writes = [ours for ours, _ in ratios]
    bare = [loop for _, loop in ratios]
    return {
        "recording_published": sum(found.published for found in counts.values()),
        "recording_dropped": sum(found.dropped for found in counts.values()),
        "recording_fps": round(min(found.fps for found in counts.values()), 2),
        "recording_write_mb_per_s": round(float(np.median(writes)), 1),
        "recording_bare_mb_per_s": round(float(np.median(bare)), 1),
        "recording_write_ratio": round(float(np.median([ours / loop for ours, loop in ratios])), 3),
        "recording_load_1min": round(os.getloadavg()[0], 2),
    }


def _pictures() -> dict[str, list[NDArray[np.uint8]]]:
    rng = np.random.default_rng(5)
    return {
        stream: [rng.integers(0, 256, (HEIGHT, WIDTH), dtype=np.uint8) for _ in range(DIFFERENT)]
        for stream in STREAMS
    }


def _frames(pictures: dict[str, list[NDArray[np.uint8]]], ticks: int) -> Iterator[tuple[str, RawFrame]]:
    """Yield `ticks` frames of each stream, the streams alternating."""
    form = stream_format(pictures[STREAMS[0]][0], bits=8)
    pose = FramePose(volts=MirrorVolts(x_v=12.5, y_v=-3.25), volts_source="fin-averaged")
    for tick in range(ticks):
        t_ns = 1_000_000_000 + round(tick * 1e9 / RATE_HZ)
        for stream in STREAMS:
            payload = pictures[stream][tick % DIFFERENT]
            yield stream, RawFrame(payload=payload, form=form, seq=tick, t_ns=t_ns, pose=pose)


def _record_paced(
    path: Path, pictures: dict[str, list[NDArray[np.uint8]]], *, seconds: float
) -> dict[str, StreamStatistics]:
    """Record at the cameras' rate; return the counts of frames."""
    recorder = Recorder(path, RecordingSession(timestamp=""))
    begin_s = time.monotonic()
    with recorder:
        for number, (stream, frame) in enumerate(_frames(pictures, round(seconds * RATE_HZ))):
            due_s = begin_s + number // len(STREAMS) / RATE_HZ
            time.sleep(max(0.0, due_s - time.monotonic()))
            recorder.publish(stream, frame)
    path.unlink()
    return recorder.statistics


@contextmanager
def _one_core() -> Iterator[None]:
    """Bind this thread, and those that it starts, to one core where the system supports it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def _write_rates(folder: Path, pictures: dict[str, list[NDArray[np.uint8]]]) -> tuple[float, float]:
    """Return MB/s of a recording whose ring is never empty, and of a bare loop directly after it."""
    ticks = RATIO_FRAMES // len(STREAMS)
    frames = list(_frames(pictures, ticks))
    path, bytes_mb = folder / "ratio.fcap", len(frames) * HEIGHT * WIDTH / 1e6
    begin_s = time.perf_counter()
    recorder = Recorder(
        path, RecordingSession(timestamp=""), options=RecordingOptions(ring_frames=len(frames))
    )
    with recorder:
        for stream, frame in frames:
            recorder.publish(stream, frame)
    ours_s = time.perf_counter() - begin_s
    path.unlink()
    begin_s = time.perf_counter()
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
    for _, frame in frames:
        os.write(file, frame.payload.data)
    os.fsync(file)
    os.close(file)
    bare_s = time.perf_counter() - begin_s
    path.unlink()
    return bytes_mb / ours_s, bytes_mb / bare_s
