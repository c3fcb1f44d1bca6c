"""`foveacam bench archive`: cut uploads, reading in place, and rates beside a plain upload by boto."""

import os
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from foveacam_bench.archive.cuts import cut_figures, resent_figures
from foveacam_bench.archive.storage_proxy import StorageProxy, storage_proxy
from foveacam_bench.archive.storage_server import BUCKET, StorageServer, storage_server
from foveacam_bench.capture.dataset_kills import KillPlan, write
from foveacam_bench.figures import Figures
from foveacam_hardware.contract import MirrorVolts
from foveacam_pipeline.capture.archiving import dataset_item, recording_item
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.recording.pixels import stream_format
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.recorder import Recorder, RecordingOptions
from foveacam_pipeline.capture.recording.session import RecordingSession
from foveacam_pipeline.capture.recording.values import FramePose, RawFrame
from foveacam_pipeline.storage.archive import ArchiveItem, ArchiveRecord, remove_large_files, upload_item
from foveacam_pipeline.storage.archive.store import ENDPOINT

HEIGHT, WIDTH = 1080, 1440
STREAMS = ("left", "center", "right")
UTC = "2026-01-01T00:00:00+00:00"
_MB = 1e6


def run(*, quick: bool = False) -> Figures:
    """Measure; `quick`: 12 cuts instead of 50, and less to upload."""
    kills, drops, large_cuts = (8, 4, 4) if quick else (25, 25, 10)
    with (
        tempfile.TemporaryDirectory() as scratch,
        storage_server() as server,
        storage_proxy(server.port) as proxy,
        _environment({**server.environment, ENDPOINT: f"http://127.0.0.1:{proxy.port}"}),
    ):
        folder = Path(scratch)
        write(folder / "cut", KillPlan(kills=0, points=6, height=60, width=80), pipe=None)
        points = 6 if quick else 24
        write(folder / "points", KillPlan(kills=0, points=points, height=HEIGHT, width=WIDTH), pipe=None)
        return {
            **cut_figures(server, folder / "cut", kills=kills, drops=drops),
            **resent_figures(server, folder, cuts=large_cuts),
            **_rates(server, folder / "points"),
            **_amplification(proxy, folder, ticks=12 if quick else 40),
            "load_1min": round(os.getloadavg()[0], 2),
        }


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables of this process within the context."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value


def _rates(server: StorageServer, folder: Path) -> Figures:
    """Return the rate of an upload with its hashes and manifest, and of a plain client's, file after file."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    size_mb = sum(path.stat().st_size for path in files) / _MB
    client = server.client()
    begin_s = time.perf_counter()
    for path in files:
        client.upload_file(str(path), BUCKET, f"plain/{path.relative_to(folder)}")
    plain_s = time.perf_counter() - begin_s
    client.close()
    with _environment({ENDPOINT: server.endpoint}):
        begin_s = time.perf_counter()
        _upload(f"s3://{BUCKET}/rate", _dataset(folder))
        ours_s = time.perf_counter() - begin_s
    return {
        "upload_mb": round(size_mb, 1),
        "upload_mb_per_s": round(size_mb / ours_s, 1),
        "boto_mb_per_s": round(size_mb / plain_s, 1),
        "upload_over_boto": round(plain_s / ours_s, 2),
    }


def _amplification(proxy: StorageProxy, folder: Path, *, ticks: int) -> Figures:
    """Return bytes read over bytes wanted: of one point of a dataset, and of one frame of a recording."""
    dataset = _dataset(folder / "points")
    remove_large_files(dataset, _upload(f"s3://{BUCKET}/points", dataset))
    before = proxy.received
    point = Dataset.open(folder / "points")[3]
    wanted = sum(point.frame(frame.role).image.nbytes for frame in point.frames)
    of_point = (proxy.received - before) / wanted
    path = folder / "looks.fcap"
    _record(path, ticks=ticks)
    item = recording_item(path, item_id="rec", label="", created_utc=UTC, beside=(), about={})
    remove_large_files(item, _upload(f"s3://{BUCKET}/looks", item))
    before = proxy.received
    with Recording(path) as recording:
        wanted = recording.frame("left", ticks // 2).raw.nbytes
    of_frame = (proxy.received - before) / wanted
    return {
        "read_amplification": round(max(of_point, of_frame), 3),
        "read_amplification_point": round(of_point, 3),
        "read_amplification_frame": round(of_frame, 3),
    }


def _dataset(folder: Path) -> ArchiveItem:
    return dataset_item(Dataset.open(folder), item_id=folder.name)


def _upload(url: str, item: ArchiveItem) -> ArchiveRecord:
    return upload_item(url, item, utc=UTC, watch=lambda done, total: None)


def _record(path: Path, *, ticks: int) -> None:
    """Record frames of noise at the cameras' size."""
    rng = np.random.default_rng(3)
    image = rng.integers(0, 256, (HEIGHT, WIDTH), dtype=np.uint8)
    form = stream_format(image, bits=8)
    pose = FramePose(volts=MirrorVolts(x_v=12.5, y_v=-3.25), volts_source="fin-averaged")
    with Recorder(path, RecordingSession(timestamp=UTC), options=RecordingOptions()) as recorder:
        for tick in range(ticks):
            for stream in STREAMS:
                frame = RawFrame(
                    payload=image, form=form, seq=tick, t_ns=10**9 + tick * 40_000_000, pose=pose
                )
                recorder.publish(stream, frame)
            time.sleep(0.02)  # the ring takes a frame while the disk writes another
