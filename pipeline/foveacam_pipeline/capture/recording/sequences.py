"""Exports a recording as numbers and pictures: one NPY array of a stream, or a ZIP of PNG with its times."""

import csv
import io
import math
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import cv2
import numpy as np

from foveacam_hardware.contract import Image, InvalidInput
from foveacam_pipeline.capture.recording.formats import FORMATS
from foveacam_pipeline.capture.recording.movie import (
    MovieSpec,
    Progress,
    check_target,
    compose_picture,
    part_of,
    picture_frames,
    rgb_picture,
    undistorter,
)
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_pipeline.capture.recording.values import RecordedFrame
from foveacam_pipeline.storage.disk import disk_errors

COLUMNS = (
    "picture", "stream", "index", "seq", "t_s", "exposure_ms", "x_v", "y_v", "ax_deg", "ay_deg",
)  # fmt: skip


def export_npy(
    recording: Recording, spec: MovieSpec, target: Path, *, progress: Progress = lambda done, total: None
) -> int:
    """Write one stream as an array (n, h, w) or (n, h, w, c) at full depth; return n.

    The pixels are the recorded ones, unpacked, and without the lens' distortion if requested.
    """
    check_target(spec, target, suffix=FORMATS["npy"].suffix)
    moments = picture_frames(recording, spec)
    if len(moments[0]) != 1:
        raise InvalidInput(f"export: an array holds one stream, not {spec.show}; choose a camera")
    straighten = undistorter(recording, spec)
    count = 0
    with _new_file(target) as file:
        for count, (frame,) in enumerate(_read(recording, moments), start=1):
            pixels = straighten(frame.image) if spec.undistorted else frame.raw
            if count == 1:
                _write_header(file, pixels, len(moments))
            file.write(np.ascontiguousarray(pixels).data)
            progress(count, len(moments))
    return count


def export_png(
    recording: Recording, spec: MovieSpec, target: Path, *, progress: Progress = lambda done, total: None
) -> int:
    """Write numbered PNG pictures and `frames.csv`, with times and poses, as a ZIP; return how many pictures.

    One camera keeps its depth; both eyes in one picture have 8 bits.
    """
    check_target(spec, target, suffix=FORMATS["png"].suffix)
    moments = picture_frames(recording, spec)
    straighten = undistorter(recording, spec)
    begin_ns, count = recording.span_ns[0], 0
    table = io.StringIO()
    rows = csv.writer(table)
    rows.writerow(COLUMNS)
    with _new_file(target) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for count, frames in enumerate(_read(recording, moments), start=1):
            name = f"{count - 1:06d}.png"
            archive.writestr(name, _png(frames, spec.show, straighten(frames[0].image)))
            rows.writerows(_row(name, frame, begin_ns) for frame in frames)
            progress(count, len(moments))
        archive.writestr("frames.csv", table.getvalue())
    return count


def _read(
    recording: Recording, moments: list[tuple[tuple[str, int], ...]]
) -> Iterator[tuple[RecordedFrame, ...]]:
    for moment in moments:
        yield tuple(recording.frame(name, index) for name, index in moment)


def _png(frames: tuple[RecordedFrame, ...], show: str, first: Image) -> bytes:
    image = first if len(frames) == 1 else compose_picture([rgb_picture(frame) for frame in frames], show)
    stored = image if image.ndim == 2 else image[..., ::-1]
    encoded = cv2.imencode(".png", stored, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    return encoded.tobytes()


def _row(name: str, frame: RecordedFrame, begin_ns: int) -> list[object]:
    pose = frame.pose
    volts = ("", "") if pose.volts is None else (pose.volts.x_v, pose.volts.y_v)
    angles = ("", "") if pose.angles_rad is None else tuple(map(math.degrees, pose.angles_rad))
    exposure_ms = "" if pose.exposure_ns is None else pose.exposure_ns / 1e6
    t_s = f"{(frame.t_ns - begin_ns) / 1e9:.9f}"
    return [name, frame.stream, frame.index, frame.seq, t_s, exposure_ms, *volts, *angles]


def _write_header(file: BinaryIO, first: Image, count: int) -> None:
    header = {
        "descr": np.lib.format.dtype_to_descr(first.dtype),
        "fortran_order": False,
        "shape": (count, *first.shape),
    }
    np.lib.format.write_array_header_1_0(file, header)


@contextmanager
def _new_file(target: Path) -> Iterator[BinaryIO]:
    """Yield a file that gets its name when all is written, and is removed when something fails."""
    part = part_of(target)
    with disk_errors(f"exporting {target.name}", target.parent, again="then export again"):
        try:
            with part.open("wb") as file:
                yield file
            part.rename(target)
        finally:
            part.unlink(missing_ok=True)
