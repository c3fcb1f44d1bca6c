"""Folders of pairs with truth: shards of arrays (npz) and one document, `pairs.json`.

The document lists the complete pairs, with the SHA-256 of each pair's arrays; `PairFolderWriter` writes both.
Needs no torch.
"""

import hashlib
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Literal, overload
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.storage.disk import disk_errors, write_file

DOCUMENT = "pairs.json"
SHARD_PAIRS = 50
"""Number of pairs in a shard; the last one may have fewer."""
KEPT_BYTES = 1 << 30
"""Size up to which pairs are cached in memory; others are read again each time."""


class Split(StrEnum):
    """Use of pairs; scenes of different splits have nothing in common."""

    TRAIN = "train"
    HELD_OUT = "held-out"


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PairEntry(_Table):
    """One pair; its index is its place in the list. Names as in `RectifiedPair`."""

    scene_seed: int
    sha256: str
    """SHA-256 of the arrays."""
    verged_z_m: float
    u0_left_px: float
    u0_right_px: float
    v0_px: float
    pose_sigma_px: float
    row_error_px: float
    """Median over pixels of the rows by which left and right picture of a point differ, px."""


class PairDocument(_Table):
    """The document of a folder."""

    format: Literal["foveacam-pairs"] = "foveacam-pairs"
    version: Literal[1] = 1
    seed: int
    split: Split
    rig_preset: str
    calibration_id: str
    width: int
    height: int
    scale: float
    """Size of a pixel of the foveae's frames in pixels of the pairs."""
    f_px: float
    baseline_m: float
    pairs: tuple[PairEntry, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairTruth:
    """Truth of the left picture of a pair, all (h, w).

    `disparity_px`: float32, left column minus right column of the surface in a pixel, NaN where there is
    none; it includes residual rectification errors, so that it is where a matcher should look. `both`: bool,
    whether both eyes see it. `occluded`: bool, whether the left eye alone sees it.
    """

    disparity_px: NDArray[np.float32]
    both: NDArray[np.bool_]
    occluded: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairSample:
    """A rectified pair, with its truth if known."""

    pair: RectifiedPair
    truth: PairTruth | None = None


def pair_arrays(pair: RectifiedPair, truth: PairTruth) -> dict[str, NDArray[np.generic]]:
    """Return the stored arrays of a pair, by name; masks are packed, eight pixels a byte."""
    masks = {
        "valid_left": pair.valid_left,
        "valid_right": pair.valid_right,
        "both": truth.both,
        "occluded": truth.occluded,
    }
    return {
        "left": pair.left,
        "right": pair.right,
        "disparity_px": truth.disparity_px,
        **{name: np.packbits(mask) for name, mask in masks.items()},
    }


def arrays_sha256(arrays: dict[str, NDArray[np.generic]]) -> str:
    """Return the SHA-256 of arrays: names, types, shapes and content."""
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


class PairFolderWriter:
    """Writes pairs in order; `flush` enters the last ones in the document."""

    def __init__(self, folder: Path, plan: PairDocument) -> None:
        """Open a folder, resuming an existing one. Raise InvalidInput when it holds other pairs."""
        self._folder, self._document = folder, plan
        with disk_errors("the pairs", folder.parent):
            folder.mkdir(parents=True, exist_ok=True)
        if (folder / DOCUMENT).exists():
            self._document = read_document(folder)
            _check_same(folder, self._document, plan)
        done = self.count
        self._shard = _read_shard(folder, done // SHARD_PAIRS) if done % SHARD_PAIRS else {}
        self._written = done

    @property
    def count(self) -> int:
        """The number of pairs so far."""
        return len(self._document.pairs)

    def add(self, entry: PairEntry, arrays: dict[str, NDArray[np.generic]]) -> None:
        """Add the next pair; write the shard when it is full."""
        self._shard |= {f"{self.count % SHARD_PAIRS:02d}.{name}": array for name, array in arrays.items()}
        self._document = self._document.model_copy(update={"pairs": (*self._document.pairs, entry)})
        if self.count % SHARD_PAIRS == 0:
            self.flush()

    def flush(self) -> PairDocument:
        """Write pending pairs; return the document. Raise StorageFull and leave what was there."""
        if self._written < self.count or not self.count:
            with disk_errors("the pairs", self._folder, again="then the same command goes on"):
                if self._shard:
                    content = io.BytesIO()
                    np.savez(content, allow_pickle=False, **self._shard)
                    write_file(
                        self._folder / shard_name((self.count - 1) // SHARD_PAIRS), content.getbuffer()
                    )
                write_file(self._folder / DOCUMENT, self._document.model_dump_json(indent=1).encode())
            self._written = self.count
        if self.count % SHARD_PAIRS == 0:
            self._shard = {}
        return self._document


class StoredPairs(Sequence[PairSample]):
    """The pairs of a folder, read on access, and checked by their hashes the first time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.document = read_document(folder)
        self._kept: dict[int, PairSample] = {}
        self._kept_bytes = 0
        self._checked: set[int] = set()

    def __len__(self) -> int:
        return len(self.document.pairs)

    @overload
    def __getitem__(self, index: int) -> PairSample: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[PairSample]: ...
    def __getitem__(self, index: int | slice) -> PairSample | Sequence[PairSample]:
        if isinstance(index, slice):
            return [self[number] for number in range(*index.indices(len(self)))]
        number = range(len(self))[index]
        return self._kept[number] if number in self._kept else self._read(number)

    def __iter__(self) -> Iterator[PairSample]:
        return (self[number] for number in range(len(self)))

    def _read(self, number: int) -> PairSample:
        shard, place = divmod(number, SHARD_PAIRS)
        entry = self.document.pairs[number]
        arrays = _read_shard(self.folder, shard, prefix=f"{place:02d}.")
        if number not in self._checked and arrays_sha256(arrays) != entry.sha256:
            raise InvalidInput(
                f"{self.folder}: pair {number} differs from its hash in {DOCUMENT}; make the pairs anew"
            )
        self._checked.add(number)
        sample = _sample(self.document, entry, arrays)
        size = sum(array.nbytes for array in arrays.values())
        if self._kept_bytes + size <= KEPT_BYTES:
            self._kept[number] = sample
            self._kept_bytes += size
        return sample


def is_pair_folder(folder: Path) -> bool:
    """Return whether a folder holds pairs with truth."""
    return (folder / DOCUMENT).is_file()


def read_document(folder: Path) -> PairDocument:
    """Return the document of a folder; raise InvalidInput if it cannot be read."""
    try:
        return PairDocument.model_validate_json((folder / DOCUMENT).read_bytes())
    except (OSError, ValidationError) as error:
        raise InvalidInput(f"{folder / DOCUMENT}: not the document of pairs ({error})") from error


def shard_name(number: int) -> str:
    """Return the name of a shard's file."""
    return f"pairs-{number:05d}.npz"


def _read_shard(folder: Path, number: int, *, prefix: str = "") -> dict[str, NDArray[np.generic]]:
    """Return the arrays of a shard whose names begin with a prefix, by the rest of their names."""
    path = folder / shard_name(number)
    try:
        with np.load(path, allow_pickle=False) as shard:
            return {name.removeprefix(prefix): shard[name] for name in shard.files if name.startswith(prefix)}
    except (OSError, ValueError, BadZipFile) as error:
        raise InvalidInput(f"{path}: the shard cannot be read ({error}); make the pairs anew") from error


def _check_same(folder: Path, found: PairDocument, asked: PairDocument) -> None:
    for name in ("seed", "split", "rig_preset", "calibration_id", "width", "height"):
        there, given = getattr(found, name), getattr(asked, name)
        if there != given:
            raise InvalidInput(
                f"{folder} holds pairs with other {name} ({there} instead of {given})",
                asked=str(given),
                found=str(there),
                remedy="give that, or another --out folder",
            )


def _sample(document: PairDocument, entry: PairEntry, arrays: dict[str, NDArray[np.generic]]) -> PairSample:
    shape = (document.height, document.width)

    def mask(name: str) -> NDArray[np.bool_]:
        bits = np.unpackbits(np.asarray(arrays[name], dtype=np.uint8), count=shape[0] * shape[1])
        return bits.reshape(shape).view(np.bool_)

    pair = RectifiedPair(
        left=np.asarray(arrays["left"], dtype=np.uint8),
        right=np.asarray(arrays["right"], dtype=np.uint8),
        valid_left=mask("valid_left"),
        valid_right=mask("valid_right"),
        f_px=document.f_px,
        baseline_m=document.baseline_m,
        u0_left_px=entry.u0_left_px,
        u0_right_px=entry.u0_right_px,
        v0_px=entry.v0_px,
        pose_sigma_px=entry.pose_sigma_px,
        t_ns=0,
    )
    truth = PairTruth(
        disparity_px=np.asarray(arrays["disparity_px"], dtype=np.float32),
        both=mask("both"),
        occluded=mask("occluded"),
    )
    return PairSample(pair=pair, truth=truth)
