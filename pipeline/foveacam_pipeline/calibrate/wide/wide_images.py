"""Views of a board from a directory of images, as of a camera that was recorded elsewhere or earlier.

Pictures are decoded as they were exposed, and of 16 bits those that the camera filled are used.
"""

import logging
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, SilentWatcher, raise_if_cancelled
from foveacam_pipeline.calibrate.wide.board_detector import detect_board, explain_absence
from foveacam_pipeline.calibrate.wide.boards import Board
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples, thumbnail
from foveacam_pipeline.storage.pictures import gray_as_exposed

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm")
_EXPLAINED = 3

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOutImage:
    """A file whose view was not used, and why, in words."""

    name: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FolderViews:
    """The views of a board in a folder of images, and the files left out, in the order of their names."""

    samples: WideSamples
    left_out: tuple[LeftOutImage, ...]


def samples_from_images(
    folder: Path,
    board: Board,
    *,
    pattern: str = "*",
    watch: ProcedureWatcher | None = None,
    role: Role = Role.WIDE,
) -> FolderViews:
    """Return the views of a board in the images of a folder whose names match `pattern`, sorted by name.

    Left out, with the reason: files that cannot be read, images of another size than most, and those without
    the board. Hidden files are not looked at. Raise InvalidInput for a folder without images, and where the
    board is in none of them.
    """
    watcher = watch or SilentWatcher()
    paths = _paths(folder, pattern)
    found: list[WideSample | LeftOutImage] = []
    for done, path in enumerate(paths):
        raise_if_cancelled(watcher, doing=f"reading images of {folder}")
        watcher.progress(done, total=len(paths), note=path.name)
        found.append(_sample(path, board))
    samples, left_out = _of_one_size(found, board, role)
    for one in left_out:
        logger.info("%s: %s", one.name, one.reason)
    watcher.progress(len(paths), total=len(paths), note=f"{len(samples)} views")
    if not len(samples):
        first = "; ".join(f"{one.name}: {one.reason}" for one in left_out[:_EXPLAINED])
        raise InvalidInput(f"{folder}: no {board} was found in any of {len(left_out)} images; {first}")
    return FolderViews(samples=samples, left_out=tuple(left_out))


def _sample(path: Path, board: Board) -> WideSample | LeftOutImage:
    """Return the view of the board in an image, or why there is none."""
    image = gray_as_exposed(path.read_bytes())
    if image is None:
        return LeftOutImage(name=path.name, reason="it cannot be read as an image of 8 or 16 bits")
    view = detect_board(image, board, effort="thorough")
    if view is None:
        return LeftOutImage(name=path.name, reason=explain_absence(image, board))
    return WideSample(view=view, thumbnail_jpeg=thumbnail(image, view), source=path.name)


def _of_one_size(
    found: list[WideSample | LeftOutImage], board: Board, role: Role
) -> tuple[WideSamples, list[LeftOutImage]]:
    """Return the views in images of the most frequent size, and all others as left out."""
    sizes = Counter((one.view.width, one.view.height) for one in found if isinstance(one, WideSample))
    usual = max(sizes, key=lambda size: sizes[size], default=(0, 0))
    samples, left_out = WideSamples(board, role=role), []
    for one in found:
        if isinstance(one, LeftOutImage):
            left_out.append(one)
        elif (one.view.width, one.view.height) == usual:
            samples.add(one)
        else:
            size = f"{one.view.width} x {one.view.height} px, most are {usual[0]} x {usual[1]}"
            left_out.append(LeftOutImage(name=one.source, reason=f"{size}: of another camera, or cropped"))
    return samples, left_out


def _paths(folder: Path, pattern: str) -> list[Path]:
    if not folder.is_dir():
        raise InvalidInput(f"{folder}: there is no such folder; give a folder of images")
    try:
        matching = sorted(folder.glob(pattern))
    except (ValueError, NotImplementedError) as error:
        raise InvalidInput(
            f"images by the pattern {pattern!r}: {str(error).rstrip('.')}; give one for names in the folder, "
            "such as 'left*', or leave it out for all"
        ) from error
    shown = [path for path in matching if not path.name.startswith(".")]
    paths = [path for path in shown if path.suffix.lower() in SUFFIXES and path.is_file()]
    if not paths:
        kinds = ", ".join(suffix[1:] for suffix in SUFFIXES)
        raise InvalidInput(f"{folder}: no image matches {pattern!r} there; files of {kinds} are read")
    return paths
