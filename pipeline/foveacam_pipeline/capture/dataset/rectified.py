"""Rectified pairs and disparities of a dataset, stored in its folder.

`rectified/pairs.csv` is written last, atomically: it lists the pairs that are valid.
"""

import csv
import hashlib
import io
from collections.abc import Callable
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, NotCalibrated
from foveacam_pipeline.capture.dataset.images import ImageCodec, encode
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.stereo.match import match
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.storage.disk import (
    disk_errors,
    finish_part,
    sync_folder,
    write_file,
    write_part,
)

RECTIFIED = "rectified"
PAIRS = "pairs.csv"


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRow:
    """One pair: its files (relative to the dataset's folder) with their SHA-256, and its geometry."""

    point: int
    bracket: int
    left: str
    left_sha256: str
    right: str
    right_sha256: str
    disparity: str
    disparity_sha256: str
    scale: float
    f_px: float
    baseline_m: float
    u0_left_px: float
    u0_right_px: float
    v0_px: float
    pose_sigma_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RectifyChoice:
    """Options of stored pairs: half or full scale, with disparities or without."""

    scale: float = 0.5
    disparities: bool = True


DEFAULT = RectifyChoice()


def rectify_dataset(
    dataset: Dataset, choice: RectifyChoice = DEFAULT, *, on_pair: Callable[[int], None] | None = None
) -> int:
    """Write the pairs of all points and brackets; return how many. `on_pair(n)` is called after each.

    Older pairs are replaced once all new ones are written.
    """
    if dataset.calibration is None:
        raise NotCalibrated(f"{dataset.folder} has no calibration: its pairs cannot be rectified")
    folder = dataset.folder / RECTIFIED
    rows: list[PairRow] = []
    with disk_errors("rectified pairs", dataset.folder):
        folder.mkdir(exist_ok=True)
        for point in dataset:
            for bracket in point.brackets:
                rows.append(_write_pair(folder, point, bracket, choice))
                if on_pair is not None:
                    on_pair(len(rows))
        sync_folder(folder)
        write_file(folder / PAIRS, _text(rows).encode())
    return len(rows)


def read_pairs(folder: Path) -> tuple[PairRow, ...]:
    """Return the stored pairs of a dataset; none when it was not rectified."""
    path = folder / RECTIFIED / PAIRS
    if not path.exists():
        return ()
    kinds = {field.name: field.type for field in fields(PairRow)}
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [
                PairRow(**{name: kinds[name](text) for name, text in row.items()})  # type: ignore[operator]  # field types are classes here
                for row in csv.DictReader(file)
            ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InvalidInput(f"{path} cannot be read ({error}); rectify the dataset again") from error
    return tuple(rows)


def disparity_bytes(residual_px: NDArray[np.float32]) -> bytes:
    """Return a float32 TIFF of (h, w) signed residual disparities, NaN where unknown."""
    done, content = cv2.imencode(
        ".tiff", residual_px, [cv2.IMWRITE_TIFF_COMPRESSION, cv2.IMWRITE_TIFF_COMPRESSION_NONE]
    )
    if not done:
        raise InvalidInput("OpenCV cannot write a disparity as TIFF")
    return content.tobytes()


def _write_pair(folder: Path, point: DatasetPoint, bracket: int, choice: RectifyChoice) -> PairRow:
    pair = point.rectified(scale=choice.scale, bracket=bracket)
    stem = f"{point.index:05d}-b{bracket}"
    left, left_sha = _write_pair_file(folder / f"{stem}-left.png", encode(pair.left, ImageCodec.PNG))
    right, right_sha = _write_pair_file(folder / f"{stem}-right.png", encode(pair.right, ImageCodec.PNG))
    disparity, disparity_sha = "", ""
    if choice.disparities:
        content = memoryview(disparity_bytes(match(pair).residual_px))
        disparity, disparity_sha = _write_pair_file(folder / f"{stem}-disparity.tiff", content)
    return PairRow(
        point=point.index,
        bracket=bracket,
        left=left,
        left_sha256=left_sha,
        right=right,
        right_sha256=right_sha,
        disparity=disparity,
        disparity_sha256=disparity_sha,
        scale=choice.scale,
        **_geometry(pair),
    )


def _geometry(pair: RectifiedPair) -> dict[str, float]:
    names = ("f_px", "baseline_m", "u0_left_px", "u0_right_px", "v0_px", "pose_sigma_px")
    return {name: float(getattr(pair, name)) for name in names}


def _write_pair_file(path: Path, content: memoryview) -> tuple[str, str]:
    write_part(path, content)
    finish_part(path)
    return f"{RECTIFIED}/{path.name}", hashlib.sha256(content).hexdigest()


def _text(rows: list[PairRow]) -> str:
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(field.name for field in fields(PairRow))
    table.writerows(astuple(row) for row in rows)
    return out.getvalue()
