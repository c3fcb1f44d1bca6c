"""Export to OME-Zarr 0.4 (Zarr 2): one image of all exposures for each camera, and the dataset's document.

The axes are t (exposures in the order of the points), c, y, x; a chunk is one exposure of one level, so that
a viewer reads what it shows. All significant bits are kept. Coordinates are pixels of the unbinned sensor.
"""

import json
import math
import shutil
import zlib
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from foveacam_hardware.contract import Frame, Image, InvalidInput, Role
from foveacam_pipeline.capture.dataset.document import DOCUMENT
from foveacam_pipeline.capture.dataset.export.point_numbers import numbers_of
from foveacam_pipeline.capture.dataset.export.target import ExportChoice
from foveacam_pipeline.capture.dataset.reader import Dataset

SUFFIX = ".ome.zarr"
SMALLEST_PX = 128
"""Least height and width of a level: a thumbnail."""
COMPRESSION = 1
"""Level of zlib: higher ones gain little on the noise of a camera."""
AXES = (("t", "time"), ("c", "channel"), ("y", "space"), ("x", "space"))


def export_ome_zarr(dataset: Dataset, folder: Path, choice: ExportChoice) -> None:
    """Write NAME.ome.zarr of each camera, and the dataset's `dataset.json`, into an empty folder."""
    series = {role: _Series(folder=folder / f"{role.value}{SUFFIX}") for role in Role}
    for point in dataset:
        taken = {(frame.role, frame.bracket) for frame in point.frames}
        for role, bracket in sorted(taken, key=lambda one: (one[1], one[0].value)):
            series[role].add(point.stacked(role, bracket=bracket), numbers_of(point, bracket))
        choice.report_point(point.index)
    for one in series.values():
        one.finish()
    shutil.copyfile(dataset.folder / DOCUMENT, folder / DOCUMENT)


def levels_of(image: Image) -> list[Image]:
    """Return the (h, w) or (h, w, 3) image, and its halves by area means down to a thumbnail."""
    levels = [image]
    while min(levels[-1].shape[:2]) // 2 >= SMALLEST_PX:
        height, width = levels[-1].shape[:2]
        half = cv2.resize(levels[-1], (width // 2, height // 2), interpolation=cv2.INTER_AREA)
        levels.append(np.asarray(half, np.uint8) if half.dtype == np.uint8 else np.asarray(half, np.uint16))
    return levels


@dataclass(slots=True, kw_only=True)
class _Series:
    """One camera's image while it is written: the form of its first exposure, and the numbers of all."""

    folder: Path
    first: Frame | None = None
    shapes: list[tuple[int, ...]] = field(default_factory=list)
    rows: list[dict[str, int | float | None]] = field(default_factory=list)

    def add(self, frame: Frame, numbers: dict[str, int | float | None]) -> None:
        """Write the levels of the next exposure; raise InvalidInput for one of another form."""
        levels = [np.atleast_3d(level).transpose(2, 0, 1) for level in levels_of(frame.image)]
        if self.first is None:
            self.first, self.shapes = frame, [planes.shape for planes in levels]
        if _form(frame) != _form(self.first):
            raise InvalidInput(
                f"the {frame.role.value} pictures of the dataset differ in size, bits or binning: one array "
                "cannot hold them; export for Hugging Face instead"
            )
        for number, planes in enumerate(levels):
            chunk = self.folder / str(number) / str(len(self.rows)) / "0" / "0" / "0"
            chunk.parent.mkdir(parents=True)
            little = np.ascontiguousarray(planes, dtype=planes.dtype.newbyteorder("<"))
            chunk.write_bytes(zlib.compress(little.tobytes(), COMPRESSION))
        own = {"t_ns": frame.t_ns, "exposure_ns": frame.exposure_ns}
        self.rows.append({name: _finite(value) for name, value in (numbers | own).items()})

    def finish(self) -> None:
        """Write what describes the image, if there is any exposure of it."""
        if self.first is None:
            return
        for number, shape in enumerate(self.shapes):
            _write_json(self.folder / str(number) / ".zarray", self._array(shape))
        _write_json(self.folder / ".zgroup", {"zarr_format": 2})
        _write_json(self.folder / ".zattrs", self._attributes(self.first))

    def _array(self, shape: tuple[int, ...]) -> dict[str, object]:
        return {
            "zarr_format": 2,
            "shape": [len(self.rows), *shape],
            "chunks": [1, *shape],
            "dtype": "|u1" if self.first is not None and self.first.image.dtype == np.uint8 else "<u2",
            "compressor": {"id": "zlib", "level": COMPRESSION},
            "fill_value": 0,
            "filters": None,
            "order": "C",
            "dimension_separator": "/",
        }

    def _attributes(self, first: Frame) -> dict[str, object]:
        name = first.role.value
        colours = ["FFFFFF"] if first.image.ndim == 2 else ["FF0000", "00FF00", "0000FF"]
        top = 2**first.bits - 1
        window = {"start": 0, "end": top, "min": 0, "max": top}
        channels = [{"label": name, "color": each, "active": True, "window": window} for each in colours]
        return {
            "multiscales": [
                {
                    "version": "0.4",
                    "name": name,
                    "type": "area mean",
                    "axes": [{"name": axis, "type": kind} for axis, kind in AXES],
                    "datasets": [self._level(number, first.binning) for number in range(len(self.shapes))],
                }
            ],
            "omero": {
                "channels": channels,
                "rdefs": {"model": "greyscale" if len(colours) == 1 else "color"},
            },
            "foveacam": {"exposures": self.rows},
        }

    def _level(self, number: int, binning: int) -> dict[str, object]:
        """Return a level's place: the size of its pixels, and the centre of its first one, sensor px."""
        steps = [
            binning * whole / part
            for whole, part in zip(self.shapes[0][1:], self.shapes[number][1:], strict=True)
        ]
        starts = [(step - 1.0) / 2.0 for step in steps]
        return {
            "path": str(number),
            "coordinateTransformations": [
                {"type": "scale", "scale": [1.0, 1.0, *steps]},
                {"type": "translation", "translation": [0.0, 0.0, *starts]},
            ],
        }


def _form(frame: Frame) -> tuple[object, ...]:
    return frame.image.shape, frame.image.dtype, frame.bits, frame.binning


def _finite(value: float | None) -> int | float | None:
    """Return a number that JSON has; None for an infinite distance."""
    return value if value is None or math.isfinite(value) else None


def _write_json(path: Path, document: dict[str, object]) -> None:
    path.write_text(json.dumps(document, indent=1, allow_nan=False), encoding="utf-8")
