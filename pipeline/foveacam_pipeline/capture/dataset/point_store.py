"""Puts one point at a time on the disk: images first, then the line of the journal that acknowledges them."""

import hashlib
import logging
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.disk import finish_part, part_of, sync_folder, write_part
from foveacam_pipeline.capture.dataset.images import Codec, encode
from foveacam_pipeline.capture.dataset.journal import Journal, JournalFile
from foveacam_pipeline.capture.dataset.values import FrameRecord, Point, PointRecord, Shot
from foveacam_pipeline.models.calibration import Calibration

IMAGES = "images"
OWN_FILE = re.compile(r"\.?\d{5,}-(wide|left|right)-b\d+-s\d+\.(tiff|png)(\.part)?")
"""Names that a writer gives: what of these no journal knows, a crash left behind."""

logger = logging.getLogger(__name__)


class PointStore:
    """The folder of a dataset, open for points; not for two threads at a time."""

    def __init__(
        self, folder: Path, journal: Journal, *, codec: Codec, calibration: Calibration | None, encoders: int
    ) -> None:
        """Open it behind the journal's last point. Raise OSError."""
        self._images = folder / IMAGES
        self._codec = codec
        self._calibration = calibration
        self._journal = JournalFile(folder, journal)
        self._pool = ThreadPoolExecutor(encoders, thread_name_prefix="dataset-encoder")

    def store(self, point: Point) -> PointRecord:
        """Put a point on the disk for good. Raise OSError; then nothing of it is left, if that can be."""
        paths = [self._images / self._name(point.place.index, shot) for shot in point.shots]
        try:
            frames = self._all_written(point.shots, paths)
            for path in paths:
                finish_part(path)
            if paths:
                sync_folder(self._images)
            record = PointRecord(place=point.place, frames=tuple(frames), skipped=point.skipped)
            self._journal.append(record)
        except Exception:
            if self._journal.clean:
                remove(paths)
            raise
        return record

    def close(self) -> None:
        """End its threads and close the journal."""
        self._pool.shutdown()
        self._journal.close()

    def _name(self, index: int, shot: Shot) -> str:
        role = shot.frame.role.value
        return f"{index:05d}-{role}-b{shot.bracket}-s{shot.stack}.{self._codec.value}"

    def _all_written(self, shots: Sequence[Shot], paths: Sequence[Path]) -> list[FrameRecord]:
        """Write all frames of a point; when one fails, the others are waited for before that is told."""
        futures = [self._pool.submit(self._written, *pair) for pair in zip(shots, paths, strict=True)]
        wait(futures)
        return [future.result() for future in futures]

    def _written(self, shot: Shot, path: Path) -> FrameRecord:
        """Encode one frame and put it on the disk under its temporary name."""
        content = encode(shot.frame.image, self._codec)
        write_part(path, content)
        frame, volts = shot.frame, shot.frame.volts
        height, width = frame.image.shape[:2]
        return FrameRecord(
            role=frame.role,
            bracket=shot.bracket,
            stack=shot.stack,
            file=f"{IMAGES}/{path.name}",
            sha256=hashlib.sha256(content).hexdigest(),
            size_bytes=len(content),
            width=width,
            height=height,
            channels=1 if frame.image.ndim == 2 else 3,
            bits=frame.bits,
            seq=frame.seq,
            epoch=frame.epoch,
            t_ns=frame.t_ns,
            exposure_ns=frame.exposure_ns,
            volts_v=None if volts is None else (volts.x_v, volts.y_v),
            gaze_rad=self._gaze_rad(shot),
        )

    def _gaze_rad(self, shot: Shot) -> tuple[float, float] | None:
        volts, role = shot.frame.volts, shot.frame.role
        if shot.gaze_rad is not None or volts is None or self._calibration is None or role is Role.WIDE:
            return shot.gaze_rad
        return self._calibration.eye(role).mirror.angles_rad(volts)


def remove(paths: Sequence[Path]) -> None:
    """Delete files, finished or not, as far as the disk lets us: what stays, the next opening removes."""
    for path in paths:
        for left in (part_of(path), path):
            try:
                left.unlink(missing_ok=True)
            except OSError as error:
                logger.info("%s stays until the dataset is opened again: %s", left, error)


def remove_unacknowledged(folder: Path, records: Sequence[PointRecord]) -> int:
    """Delete images that no line of the journal knows; return how many. Other names are left alone."""
    known = {frame.file for record in records for frame in record.frames}
    strays = [
        path
        for path in (folder / IMAGES).iterdir()
        if OWN_FILE.fullmatch(path.name) and f"{IMAGES}/{path.name}" not in known
    ]
    for path in strays:
        path.unlink()
    return len(strays)
