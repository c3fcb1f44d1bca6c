"""Writes one point at a time to disk: its images first, then the journal line that acknowledges them."""

import hashlib
import logging
import re
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.journal import JournalContent, JournalFile
from foveacam_pipeline.capture.dataset.values import (
    CapturedPoint,
    FrameRecord,
    PlanPosition,
    PointRecord,
    Shot,
)
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.disk import finish_part, part_path, sync_folder, write_part

IMAGES = "images"
IMAGE_FILE_NAME = re.compile(r"\.?\d{5,}-(wide|left|right)-b\d+-s\d+\.(tiff|png)(\.part)?")
"""Names that the writer gives to images; such a file that the journal does not list was left by a crash."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BegunPoint:
    """A point whose files are being written under their temporary names. `raw_bytes`: size of its pixels."""

    place: PlanPosition
    skipped: str
    raw_bytes: int
    paths: tuple[Path, ...]
    files: tuple[Future[FrameRecord], ...]


class PointStore:
    """A dataset's folder, open for points: one thread begins, another commits them, in the same order."""

    def __init__(
        self,
        folder: Path,
        journal: JournalContent,
        *,
        codec: ImageCodec,
        calibration: Calibration | None,
        encoders: int,
    ) -> None:
        """Open the folder behind the journal's last point. Raise OSError."""
        self._images = folder / IMAGES
        self._codec = codec
        self._calibration = calibration
        self._journal = JournalFile(folder, journal)
        self._pool = ThreadPoolExecutor(encoders, thread_name_prefix="dataset-encoder")

    def begin(self, point: CapturedPoint) -> "BegunPoint":
        """Start to encode the files of a point, which is then to be committed or dropped."""
        paths = [self._images / self._name(point.place.index, shot) for shot in point.shots]
        files = [self._pool.submit(self._write_frame, *pair) for pair in zip(point.shots, paths, strict=True)]
        return BegunPoint(
            place=point.place,
            skipped=point.skipped,
            raw_bytes=sum(shot.frame.image.nbytes for shot in point.shots),
            paths=tuple(paths),
            files=tuple(files),
        )

    def commit(self, begun: "BegunPoint") -> PointRecord:
        """Write a point durably. Raise OSError; its files are then removed where possible."""
        try:
            wait(begun.files)
            frames = tuple(file.result() for file in begun.files)
            for path in begun.paths:
                finish_part(path)
            if begun.paths:
                sync_folder(self._images)
            record = PointRecord(place=begun.place, frames=frames, skipped=begun.skipped)
            self._journal.append(record)
        except Exception:
            if self._journal.clean:
                remove_files(begun.paths)
            raise
        return record

    def drop(self, begun: "BegunPoint") -> None:
        """Discard a point that was begun, with its files."""
        wait(begun.files)
        remove_files(begun.paths)

    def close(self) -> None:
        """End the encoder threads and close the journal."""
        self._pool.shutdown()
        self._journal.close()

    def _name(self, index: int, shot: Shot) -> str:
        role = shot.frame.role.value
        return f"{index:05d}-{role}-b{shot.bracket}-s{shot.stack}.{self._codec.value}"

    def _write_frame(self, shot: Shot, path: Path) -> FrameRecord:
        """Encode one frame and write it under its temporary name."""
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
            binning=frame.binning,
        )

    def _gaze_rad(self, shot: Shot) -> tuple[float, float] | None:
        volts, role = shot.frame.volts, shot.frame.role
        if shot.gaze_rad is not None or volts is None or self._calibration is None or role is Role.WIDE:
            return shot.gaze_rad
        return self._calibration.eye(role).mirror.angles_rad(volts)


def remove_files(paths: Sequence[Path]) -> None:
    """Delete files, finished or not; what cannot be deleted now is removed at the next opening."""
    for path in paths:
        for left in (part_path(path), path):
            try:
                left.unlink(missing_ok=True)
            except OSError as error:
                logger.info("%s stays until the dataset is opened again: %s", left, error)


def remove_unacknowledged(folder: Path, records: Sequence[PointRecord]) -> int:
    """Delete the writer's images that the journal does not list, and no other file; return how many."""
    known = {frame.file for record in records for frame in record.frames}
    leftovers = [
        path
        for path in (folder / IMAGES).iterdir()
        if IMAGE_FILE_NAME.fullmatch(path.name) and f"{IMAGES}/{path.name}" not in known
    ]
    for path in leftovers:
        path.unlink()
    return len(leftovers)
