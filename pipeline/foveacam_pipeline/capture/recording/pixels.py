"""Between pictures and the bytes of a stream: packed twelve bits, mosaics, channel orders, zlib."""

import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Image, InvalidInput
from foveacam_pipeline.capture.recording.values import RawFrame, StreamFormat

ZLIB_LEVEL = 1
"""Sensor noise compresses no further with more effort."""
FULL_12 = 4095

Bytes: TypeAlias = bytes | memoryview

MOSAICS = {
    "BayerRG": cv2.COLOR_BayerBG2RGB,
    "BayerBG": cv2.COLOR_BayerRG2RGB,
    "BayerGR": cv2.COLOR_BayerGB2RGB,
    "BayerGB": cv2.COLOR_BayerGR2RGB,
}
"""OpenCV names a mosaic by its second row and column: GenICam's RG is its BG."""
SMALL_PX = 8
"""A mosaic with a shorter side is interpolated as a whole, a larger one's borders in strips."""
REFLECTED_PX = 2
"""Reflected pixels beyond a border have the colours that the mosaic would go on with."""
ORDERS: dict[str, Callable[[Image], NDArray[np.generic]]] = {
    "RGB8": lambda image: image,
    "RGB16": lambda image: image,
    "BGR8": lambda image: image[:, :, ::-1],
    "RGBA8": lambda image: image[:, :, :3],
    "BGRA8": lambda image: image[:, :, 2::-1],
}
GREY = ("Mono8", "Mono16", "Mono12", "Mono12p")


def stream_format(image: Image, *, bits: int, packed: bool = False) -> StreamFormat:
    """Return how a picture is recorded: (h, w) grey or (h, w, 3) RGB, uint8 or uint16 of `bits` bits.

    `packed`: grey of twelve bits in three bytes for two pixels. RGB of more than eight bits is called RGB16,
    a name that the authors' application does not know.
    """
    height, width = image.shape[:2]
    channels = image.shape[2] if image.ndim == 3 else 1
    deep = image.dtype == np.uint16
    if channels == 1:
        name = ("Mono12p" if bits == 12 else "Mono16") if deep else "Mono8"
    else:
        name = "RGB16" if deep else "RGB8"
    is_packed = packed and name == "Mono12p"
    return StreamFormat(
        pixel_format=name,
        dtype="U16" if deep and not is_packed else "U8",
        height=height,
        width=width,
        channels=channels,
        bits=bits,
    )


def payload_of(image: Image, form: StreamFormat) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Return the picture as it lies on the file, contiguous; not a copy when it lies so already."""
    if form.packed:
        return pack_12p(image)
    return image if image.flags.c_contiguous else image.copy()


def compressed(frame: RawFrame) -> RawFrame:
    """Return the frame as one zlib stream."""
    data = zlib.compress(frame.payload.data.cast("B"), ZLIB_LEVEL)
    return frame.of_form(replace(frame.form, compressed=True), np.frombuffer(data, dtype=np.uint8))


def pack_12p(image: Image) -> NDArray[np.uint8]:
    """Return (n,) uint8 of GenICam's 12p: two pixels in three bytes, low bits first."""
    flat = image.reshape(-1).astype(np.uint16)
    even, odd = flat[0::2], flat[1::2]
    if odd.size < even.size:
        odd = np.append(odd, np.uint16(0))
    triples = np.empty((even.size, 3), dtype=np.uint8)
    triples[:, 0] = even & 0xFF
    triples[:, 1] = (odd & 0x0F) << 4 | even >> 8
    triples[:, 2] = odd >> 4
    return triples.reshape(-1)[: (12 * flat.size + 7) // 8]


def unpack_12p(packed: NDArray[np.uint8], *, height: int, width: int) -> NDArray[np.uint16]:
    """Return (height, width) uint16 of GenICam's 12p; `packed`: (n,) uint8 of exactly as many bytes."""
    pixels = height * width
    whole = (pixels + 1) // 2 * 3
    data = np.concatenate([packed, np.zeros(whole - packed.size, dtype=np.uint8)])
    triples = data.reshape(-1, 3).astype(np.uint16)
    pairs = np.empty((triples.shape[0], 2), dtype=np.uint16)
    pairs[:, 0] = triples[:, 0] | (triples[:, 1] & 0x0F) << 8
    pairs[:, 1] = triples[:, 1] >> 4 | triples[:, 2] << 4
    return pairs.reshape(-1)[:pixels].reshape(height, width)


def pixels_of(payload: Bytes, form: StreamFormat, *, what: str) -> Image:
    """Return the pixels of a message as they were recorded, a copy of its own: (h, w) or (h, w, channels).

    Raise `InvalidInput` for bytes that are no frame of this form.
    """
    data = payload
    if form.compressed:
        data = _inflated(payload, form, what)
    if len(data) != form.frame_bytes:
        raise InvalidInput(
            f"{what}: {form.width} x {form.height} of {form.pixel_format} are {form.frame_bytes} bytes,"
            f" {len(data)} were found; the file is damaged here"
        )
    flat = np.frombuffer(data, dtype=np.uint8)
    if form.packed:
        return unpack_12p(flat, height=form.height, width=form.width)
    shape = (form.height, form.width) + ((form.channels,) if form.channels > 1 else ())
    return flat.reshape(shape).copy() if form.dtype == "U8" else flat.view(np.uint16).reshape(shape).copy()


def _inflated(payload: Bytes, form: StreamFormat, what: str) -> bytes:
    """Return what a zlib stream holds, and never more than a frame: it may be made to explode."""
    inflater = zlib.decompressobj()
    try:
        return inflater.decompress(payload, form.frame_bytes + 1)
    except zlib.error as error:
        raise InvalidInput(
            f"{what}: it cannot be decompressed ({error}); the file is damaged here"
        ) from error


def picture_of(pixels: Image, form: StreamFormat, *, what: str) -> Image:
    """Return recorded pixels as grey or RGB, contiguous: themselves where they are that already.

    Raise `InvalidInput` for a format that is not known.
    """
    name, image = form.pixel_format, pixels
    mosaic = MOSAICS.get(name[:7]) if name.startswith("Bayer") else None
    if mosaic is not None and image.ndim == 2:
        return demosaiced(image, mosaic)
    if name in GREY and image.ndim == 2:
        return image
    if name in ORDERS and image.ndim == 3:
        return _of_kind(np.ascontiguousarray(ORDERS[name](image)))
    raise InvalidInput(
        f"{what}: pixels of format {name!r} and shape {image.shape} are not known here; known are"
        f" {', '.join([*GREY, *ORDERS, *(f'{mosaic}8, 16 or 12p' for mosaic in MOSAICS)])}"
    )


def demosaiced(mosaic: Image, code: int) -> Image:
    """Return (h, w, 3) RGB of an (h, w) mosaic, its borders interpolated as its inside is."""
    height, width = mosaic.shape
    if min(height, width) < SMALL_PX:
        return _reflected(mosaic, code)
    rgb = _of_kind(cv2.cvtColor(mosaic, code))  # here OpenCV replaces each border by what lies beside it
    bottom, right = (height - 3) // 2 * 2, (width - 3) // 2 * 2  # where a strip begins as the mosaic does
    rgb[0], rgb[-1] = _reflected(mosaic[:4], code)[0], _reflected(mosaic[bottom:], code)[-1]
    rgb[:, 0] = _reflected(mosaic[:, :4], code)[:, 0]
    rgb[:, -1] = _reflected(mosaic[:, right:], code)[:, -1]
    return rgb


def _reflected(mosaic: Image, code: int) -> Image:
    """Return a mosaic as RGB, as if it were reflected at its borders."""
    reflected = cv2.copyMakeBorder(mosaic, *(REFLECTED_PX,) * 4, cv2.BORDER_REFLECT_101)
    inner = slice(REFLECTED_PX, -REFLECTED_PX)
    return _of_kind(np.ascontiguousarray(cv2.cvtColor(reflected, code)[inner, inner]))


def _of_kind(pixels: object) -> Image:
    found = np.asarray(pixels)
    if found.dtype == np.uint8:
        return found.astype(np.uint8, copy=False)
    return found.astype(np.uint16, copy=False)


def eight_bit(image: Image, *, bits: int) -> NDArray[np.uint8]:
    """Return a picture in eight bits: full scale stays full scale."""
    if image.dtype == np.uint8:
        return image.astype(np.uint8, copy=False)
    full = FULL_12 if bits == 12 else (1 << bits) - 1
    table = np.clip(np.arange(1 << 16, dtype=np.float64) * 255.0 / full + 0.5, 0.0, 255.0).astype(np.uint8)
    return table[image]
