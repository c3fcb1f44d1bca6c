"""Views of a board from a directory of images, as of a camera that was recorded elsewhere or earlier."""

import logging
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher, raise_if_cancelled
from foveacam_pipeline.calibrate.wide.board_detector import detect_board, explain_absence
from foveacam_pipeline.calibrate.wide.boards import Board
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples, thumbnail

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm")
_EXPLAINED = 3

logger = logging.getLogger(__name__)


def samples_from_images(
    folder: Path,
    board: Board,
    *,
    pattern: str = "*",
    watch: ProcedureWatcher | None = None,
    role: Role = Role.WIDE,
) -> WideSamples:
    """Return the views of a board in the images of a folder whose names match `pattern`, sorted by name.

    Raise InvalidInput for a folder without images, an unreadable file, images of different sizes, and where
    the board is in none of them; each is named. Images without the board are left out.
    """
    watcher = watch or SilentWatcher()
    paths = _paths(folder, pattern)
    samples, without = WideSamples(board, role=role), []
    first_size: tuple[str, int, int] | None = None
    for done, path in enumerate(paths):
        raise_if_cancelled(watcher, doing=f"reading images of {folder}")
        watcher.progress(done, total=len(paths), note=path.name)
        gray = _read(path)
        height, width = gray.shape
        first_size = first_size or (path.name, width, height)
        if (width, height) != first_size[1:]:
            raise InvalidInput(
                f"{path.name} is {width} x {height} px, {first_size[0]} {first_size[1]} x {first_size[2]}; "
                "give images of one camera, uncropped, or choose some by a pattern"
            )
        view = detect_board(gray, board, effort="thorough")
        if view is None:
            without.append(path)
            logger.info("%s: no %s found", path.name, board)
            continue
        samples.add(WideSample(view=view, thumbnail_jpeg=thumbnail(gray, view), source=path.name))
    watcher.progress(len(paths), total=len(paths), note=f"{len(samples)} views")
    if not len(samples):
        raise InvalidInput(_none_found(folder, board, without))
    return samples


def _paths(folder: Path, pattern: str) -> list[Path]:
    if not folder.is_dir():
        raise InvalidInput(f"{folder}: there is no such folder; give a folder of images")
    paths = sorted(p for p in folder.glob(pattern) if p.suffix.lower() in SUFFIXES and p.is_file())
    if not paths:
        kinds = ", ".join(suffix[1:] for suffix in SUFFIXES)
        raise InvalidInput(f"{folder}: no image matches {pattern!r} there; files of {kinds} are read")
    return paths


def _read(path: Path) -> NDArray[np.uint8]:
    content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    image = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if len(content) else None
    if image is None:
        raise InvalidInput(
            f"{path}: this file of {len(content)} bytes cannot be read as an image; repair or remove it"
        )
    return np.asarray(image, dtype=np.uint8)


def _none_found(folder: Path, board: Board, without: list[Path]) -> str:
    reasons = [f"{path.name}: {explain_absence(_read(path), board)}" for path in without[:_EXPLAINED]]
    return f"{folder}: no {board} was found in any of {len(without)} images; {'; '.join(reasons)}"
