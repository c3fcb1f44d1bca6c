"""Writes photographs as the files that cameras, telephones and archives leave in a folder."""

import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_bench.accept.photo_pictures import Picture

Writer: TypeAlias = Callable[[Path, Sequence[Picture]], None]
"""Writes photographs into a folder."""
JPEG = (cv2.IMWRITE_JPEG_QUALITY, 95)
ODD_SIZE, EMPTY, TEXT, CUT, WALL = "odd.png", "empty.jpg", "text.png", "cut.jpg", "wall.png"
"""Names of the files that are not to be used."""
ORIENTATION = 0x0112
"""Tag of EXIF 2.3, section 4.6.4, that says how a viewer should turn a picture."""


def as_png(folder: Path, pictures: Sequence[Picture]) -> None:
    """Write PNG files of 8 bits."""
    for k, picture in enumerate(pictures):
        _write(folder / f"view{k:02d}.png", _in_bits(picture, 8))


def as_jpeg(folder: Path, pictures: Sequence[Picture], *, orientation: int | None = None) -> None:
    """Write JPEG files, with the same pixels whatever the orientation in their tag."""
    for k, picture in enumerate(pictures):
        content = cv2.imencode(".jpg", _in_bits(picture, 8), JPEG)[1].tobytes()
        tagged = content if orientation is None else _tagged(content, orientation)
        (folder / f"IMG_{k:04d}.JPG").write_bytes(tagged)


def as_low_bits(folder: Path, pictures: Sequence[Picture], *, bits: int) -> None:
    """Write PNG files of 16 bits, of which the lowest `bits` are filled."""
    for k, picture in enumerate(pictures):
        _write(folder / f"raw{k:02d}.png", _in_bits(picture, bits))


def as_transparent(folder: Path, pictures: Sequence[Picture]) -> None:
    """Write colour PNG files whose opacity falls to none across the picture."""
    for k, picture in enumerate(pictures):
        grey = _in_bits(picture, 8)
        opacity = np.broadcast_to(np.linspace(255.0, 0.0, grey.shape[1]), grey.shape).astype(grey.dtype)
        _write(folder / f"view{k:02d}.png", np.stack([grey, grey, grey, opacity], axis=-1))


def with_odd_size(folder: Path, pictures: Sequence[Picture]) -> None:
    """Write PNG files, of which one is smaller than the others."""
    as_png(folder, pictures[1:])
    height, width = pictures[0].shape
    smaller = cv2.resize(pictures[0], (width * 3 // 4, height * 3 // 4), interpolation=cv2.INTER_AREA)
    _write(folder / ODD_SIZE, _in_bits(np.asarray(smaller, dtype=np.float32), 8))


def with_broken_files(folder: Path, pictures: Sequence[Picture]) -> None:
    """Write JPEG files, and beside them what a copy from a Mac and a full card leave."""
    as_jpeg(folder, pictures)
    for k in range(len(pictures)):
        (folder / f"._IMG_{k:04d}.JPG").write_bytes(b"\x00\x05\x16\x07\x00\x02\x00\x00Mac OS X        ")
    whole = (folder / "IMG_0000.JPG").read_bytes()
    (folder / CUT).write_bytes(whole[: len(whole) // 5])
    (folder / EMPTY).write_bytes(b"")
    (folder / TEXT).write_text("<html>Sign in to continue</html>", encoding="utf-8")
    (folder / "notes.txt").write_text("squares of 25 mm", encoding="utf-8")
    _write(folder / WALL, np.full(pictures[0].shape, 90, dtype=np.uint8))


def _in_bits(picture: Picture, bits: int) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Return grey values of 0 to 1 as integers of so many bits."""
    values = np.rint(picture * (2**bits - 1.0))
    return np.asarray(values, dtype=np.uint8) if bits == 8 else np.asarray(values, dtype=np.uint16)


def _write(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    path.write_bytes(cv2.imencode(path.suffix, image)[1].tobytes())


def _tagged(jpeg: bytes, orientation: int) -> bytes:
    """Return a JPEG file with an EXIF segment after its first marker."""
    entry = struct.pack("<HHIHH", ORIENTATION, 3, 1, orientation, 0)
    exif = b"Exif\0\0II*\0" + struct.pack("<IH", 8, 1) + entry + struct.pack("<I", 0)
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + jpeg[2:]
