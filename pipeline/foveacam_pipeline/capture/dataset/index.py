"""`frames.csv`, the index of a dataset for people and other programs: one row a frame, from the journal."""

import csv
import io
from collections.abc import Iterable
from pathlib import Path

from foveacam_pipeline.capture.dataset.values import FrameRecord, PointRecord
from foveacam_pipeline.storage.disk import write_file

INDEX = "frames.csv"
COLUMNS = (
    "point", "scan", "column", "row", "role", "bracket", "stack", "file", "sha256", "size_bytes",
    "width", "height", "channels", "bits", "seq", "epoch", "t_ns", "exposure_ns", "x_v", "y_v",
    "gaze_ax_rad", "gaze_ay_rad", "aim_ax_rad", "aim_ay_rad", "distance_m", "rail_m", "pan_rad", "tilt_rad",
    "binning",
)  # fmt: skip


def index_text(records: Iterable[PointRecord]) -> str:
    """Return the content of the file; numbers keep full precision, unknown values are empty."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(COLUMNS)
    for record in records:
        table.writerows(_row(record, frame) for frame in record.frames)
    return out.getvalue()


def write_index(folder: Path, records: Iterable[PointRecord]) -> None:
    """Write the index atomically. Raise OSError."""
    write_file(folder / INDEX, index_text(records).encode("utf-8"))


def _row(record: PointRecord, frame: FrameRecord) -> list[object]:
    place = record.place
    return [
        place.index, place.scan, place.column, place.row, frame.role.value, frame.bracket, frame.stack,
        frame.file, frame.sha256, frame.size_bytes, frame.width, frame.height, frame.channels, frame.bits,
        frame.seq, frame.epoch, frame.t_ns, frame.exposure_ns, *_pair(frame.volts_v), *_pair(frame.gaze_rad),
        *_pair(place.aim_rad), place.distance_m, place.rail_m, place.pan_rad, place.tilt_rad,
        frame.binning,
    ]  # fmt: skip


def _pair(values: tuple[float, float] | None) -> tuple[float | None, float | None]:
    return (None, None) if values is None else values
