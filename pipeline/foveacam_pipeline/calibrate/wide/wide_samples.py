"""The views of a board by one camera, in memory and in a session's folder.

`wide.json` holds the corners, `wide/<id>.jpg` a thumbnail of each view; those of a fovea are named by
its role.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.wide.board_detector import BoardView
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco, Checkerboard
from foveacam_pipeline.models.content import Plain, content_id, plain
from foveacam_pipeline.storage.disk import write_file

FORMAT = "foveacam-wide-samples"
VERSION = 1
THUMBNAIL_WIDTH = 320
_QUALITY = 80


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WideSample:
    """One view; `frames`: number of averaged images; `source`: a file's name, or empty."""

    view: BoardView
    thumbnail_jpeg: bytes
    frames: int = 1
    source: str = ""

    @property
    def id(self) -> str:
        """Id of the view, the hash of its corners."""
        return content_id([plain(self.view.ids), plain(self.view.corners_px)])


class WideSamples:
    """Views of one board by one camera, in the order of capture."""

    def __init__(self, board: Board, samples: Iterable[WideSample] = (), *, role: Role = Role.WIDE) -> None:
        self.board = board
        self.role = role
        self._samples: dict[str, WideSample] = {}
        for sample in samples:
            self.add(sample)

    def __len__(self) -> int:
        return len(self._samples)

    def __iter__(self) -> Iterator[WideSample]:
        return iter(tuple(self._samples.values()))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the images, px; (0, 0) without samples."""
        for sample in self._samples.values():
            return sample.view.width, sample.view.height
        return 0, 0

    def get(self, sample_id: str) -> WideSample:
        """Return a sample or raise InvalidInput."""
        if sample_id not in self._samples:
            raise InvalidInput(f"view {sample_id!r} of the board: there is none; reload the list of views")
        return self._samples[sample_id]

    def add(self, sample: WideSample) -> None:
        """Add a view of the same board and size; one that was added already is unchanged."""
        view = sample.view
        if view.board != self.board:
            raise InvalidInput(
                f"views of a {self.board} ({_sizes(self.board)}) were taken so far, this one shows a "
                f"{view.board} ({_sizes(view.board)}); use one board, or begin anew"
            )
        if len(self) and (view.width, view.height) != self.size:
            raise InvalidInput(
                f"views so far are {self.size[0]} x {self.size[1]} px, "
                f"{sample.source or 'this one'} is {view.width} x {view.height} px; "
                "use images of one camera, uncropped"
            )
        self._samples.setdefault(sample.id, sample)

    def remove(self, sample_id: str) -> None:
        """Remove a view, or raise InvalidInput."""
        self.get(sample_id)
        del self._samples[sample_id]

    def save(self, folder: Path) -> None:
        """Write all views to a folder atomically; refuse to overwrite another board's views."""
        path = views_path(folder, self.role)
        if path.exists():
            found = WideSamples.load(folder, self.role)
            if found.board != self.board or (len(found) and len(self) and found.size != self.size):
                raise InvalidInput(
                    f"{path} holds views of a {found.board} ({_sizes(found.board)}), "
                    f"{found.size[0]} x {found.size[1]} px; nothing was overwritten: use another folder"
                )
        thumbnails = thumbnails_folder(folder, self.role)
        thumbnails.mkdir(parents=True, exist_ok=True)
        for sample in self:
            picture = thumbnails / f"{sample.id}.jpg"
            if not picture.exists():
                write_file(picture, sample.thumbnail_jpeg)
        write_file(path, json.dumps(self._document(), allow_nan=False, indent=1).encode())
        for picture in thumbnails.glob("*.jpg"):
            if picture.stem not in self._samples:
                picture.unlink()

    @staticmethod
    def load(folder: Path, role: Role = Role.WIDE) -> "WideSamples":
        """Read the views of a folder; raise InvalidInput naming the file and what is wrong with it."""
        path = views_path(folder, role)
        try:
            document = _Document.model_validate_json(path.read_bytes())
        except FileNotFoundError as error:
            raise InvalidInput(f"{path}: there is no such file; take views of a board first") from error
        except (OSError, ValidationError) as error:
            why = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
            raise InvalidInput(
                f"{path} cannot be read ({why}); restore it, or take the views again"
            ) from error
        return document.build(role, thumbnails_folder(folder, role), path)

    def _document(self) -> Plain:
        width, height = self.size
        return {
            "format": FORMAT,
            "version": VERSION,
            "board": {"kind": self.board.kind, **_fields(self.board)},
            "width": width,
            "height": height,
            "samples": [
                {
                    "id": sample.id,
                    "source": sample.source,
                    "frames": sample.frames,
                    "ids": plain(sample.view.ids),
                    "corners_px": plain(sample.view.corners_px),
                }
                for sample in self
            ],
        }


def views_path(folder: Path, role: Role = Role.WIDE) -> Path:
    """Return the file of a camera's views in a session's folder."""
    return folder / f"{role.value}.json"


def thumbnails_folder(folder: Path, role: Role = Role.WIDE) -> Path:
    """Return the folder of the thumbnails of a camera's views in a session's folder."""
    return folder / role.value


def thumbnail(image: NDArray[np.uint8], view: BoardView) -> bytes:
    """Return a JPEG, 320 px wide, of an image (h, w) or (h, w, 3) RGB with the corners drawn into it."""
    scale = THUMBNAIL_WIDTH / image.shape[1]
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    picture = cv2.cvtColor(small, cv2.COLOR_GRAY2BGR if small.ndim == 2 else cv2.COLOR_RGB2BGR)
    for x, y in np.rint(view.corners_px * scale).astype(int).tolist():
        cv2.circle(picture, (x, y), 2, (100, 220, 80), -1, cv2.LINE_AA)
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _Board(_Strict):
    kind: Literal["checkerboard", "charuco"]
    columns: int
    rows: int
    square_m: float
    marker_m: float | None = None
    dictionary: str | None = None
    legacy_pattern: bool = False

    def build(self) -> Board:
        sizes = {"columns": self.columns, "rows": self.rows}
        if self.kind == "checkerboard":
            return Checkerboard(**sizes, square_m=self.square_m)
        return Charuco(
            **sizes,
            square_m=self.square_m,
            marker_m=self.marker_m or 0.0,
            dictionary=self.dictionary or "",
            legacy_pattern=self.legacy_pattern,
        )


class _Sample(_Strict):
    id: str
    source: str
    frames: Annotated[int, Field(ge=1)]
    ids: list[Annotated[int, Field(ge=0)]]
    corners_px: list[tuple[float, float]]


class _Document(_Strict):
    format: Literal["foveacam-wide-samples"]
    version: Literal[1]
    board: _Board
    width: Annotated[int, Field(ge=0)]
    height: Annotated[int, Field(ge=0)]
    samples: list[_Sample]

    def build(self, role: Role, thumbnails: Path, path: Path) -> WideSamples:
        board = self.board.build()
        samples = WideSamples(board, role=role)
        for stored in self.samples:
            numbered = max(stored.ids, default=-1) < board.corners
            if len(stored.ids) != len(stored.corners_px) or not numbered:
                raise InvalidInput(
                    f"{path}: view {stored.id} has {len(stored.corners_px)} corners and {len(stored.ids)} "
                    f"numbers on a board of {board.corners}; restore the file, or take the views again"
                )
            view = BoardView(
                board=board,
                corners_px=np.array(stored.corners_px, dtype=np.float64).reshape(-1, 2),
                ids=np.array(stored.ids, dtype=np.int64),
                width=self.width,
                height=self.height,
            )
            picture = thumbnails / f"{stored.id}.jpg"
            jpeg = picture.read_bytes() if picture.is_file() else b""
            samples.add(
                WideSample(view=view, thumbnail_jpeg=jpeg, frames=stored.frames, source=stored.source)
            )
        return samples


def _fields(board: Board) -> dict[str, Plain]:
    document = plain(board)
    return document if isinstance(document, dict) else {}


def _sizes(board: Board) -> str:
    marker = f", markers {board.marker_m * 1e3:g} mm of {board.drawn}" if isinstance(board, Charuco) else ""
    return f"squares {board.square_m * 1e3:g} mm{marker}"
