"""Converts between pictures and a stream's bytes: packed 12 bit, Bayer mosaics, channel orders, zlib."""

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
"""Sensor noise compresses no further at a higher level."""
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
"""A mosaic with a shorter side is interpolated as a whole; of a larger one only the borders, in strips."""
REFLECTED_PX = 2
"""Reflected pixels beyond a border have the colours with which the mosaic would continue."""
ORDERS: dict[str, Callable[[Image], NDArray[np.generic]]] = {
    "RGB8": lambda image: image,
    "RGB16": lambda image: image,
    "BGR8": lambda image: image[:, :, ::-1],
    "RGBA8": lambda image: image[:, :, :3],
    "BGRA8": lambda image: image[:, :, 2::-1],
}
GREY = ("Mono8", "Mono16", "Mono12", "Mono12p")


def stream_format(image: Image, *, bits: int, packed: bool = False) -> StreamFormat:
    """Return the stream format of a picture: (h, w) grey or (h, w, 3) RGB, uint8 or uint16 of `bits` bits.

    `packed`: grey of twelve bits in three bytes for two pixels. RGB of more than eight bits is called
    RGB16, a name that the authors' application does not know.
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
    """Return the picture as it is stored, contiguous; not copied when it is stored unchanged."""
    if form.packed:
        return pack_12p(image)
    return image if image.flags.c_contiguous else image.copy()


def compress_frame(frame: RawFrame) -> RawFrame:
    """Return the frame as one zlib stream."""
    data = zlib.compress(frame.payload.data.cast("B"), ZLIB_LEVEL)
    return frame.with_payload(replace(frame.form, compressed=True), np.frombuffer(data, dtype=np.uint8))


def pack_12p(image: Image) -> NDArray[np.uint8]:
    """Return (n,) uint8 in GenICam's 12p: two pixels in three bytes, low bits first."""
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
    """Return (height, width) uint16 from GenICam's 12p; `packed`: (n,) uint8 of exactly as many bytes."""
    pixels = height * width
    whole = (pixels + 1) // 2 * 3
    data = np.concatenate([packed, np.zeros(whole - packed.size, dtype=np.uint8)])
    triples = data.reshape(-1, 3).astype(np.uint16)
    pairs = np.empty((triples.shape[0], 2), dtype=np.uint16)
    pairs[:, 0] = triples[:, 0] | (triples[:, 1] & 0x0F) << 8
    pairs[:, 1] = triples[:, 1] >> 4 | triples[:, 2] << 4
    return pairs.reshape(-1)[:pixels].reshape(height, width)


def pixels_of(payload: Bytes, form: StreamFormat, *, what: str) -> Image:
    """Return a copy of the recorded pixels of a message: (h, w) or (h, w, channels).

    Raise `InvalidInput` for bytes that are no frame of this format.
    """
    data = payload
    if form.compressed:
        data = _inflate(payload, form, what)
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


def _inflate(payload: Bytes, form: StreamFormat, what: str) -> bytes:
    """Return the content of a zlib stream, at most one frame: a crafted stream may expand without limit."""
    inflater = zlib.decompressobj()
    try:
        return inflater.decompress(payload, form.frame_bytes + 1)
    except zlib.error as error:
        raise InvalidInput(
            f"{what}: it cannot be decompressed ({error}); the file is damaged here"
        ) from error


def picture_of(pixels: Image, form: StreamFormat, *, what: str) -> Image:
    """Return recorded pixels as contiguous grey or RGB: unchanged where they are that already.

    Raise `InvalidInput` for an unknown format.
    """
    name, image = form.pixel_format, pixels
    mosaic = MOSAICS.get(name[:7]) if name.startswith("Bayer") else None
    if mosaic is not None and image.ndim == 2:
        return demosaic(image, mosaic)
    if name in GREY and image.ndim == 2:
        return image
    if name in ORDERS and image.ndim == 3:
        return as_image(np.ascontiguousarray(ORDERS[name](image)))
    raise InvalidInput(
        f"{what}: pixels of format {name!r} and shape {image.shape} are not known here; known are"
        f" {', '.join([*GREY, *ORDERS, *(f'{mosaic}8, 16 or 12p' for mosaic in MOSAICS)])}"
    )


def demosaic(mosaic: Image, code: int) -> Image:
    """Return (h, w, 3) RGB of an (h, w) mosaic, its borders interpolated like its inside."""
    height, width = mosaic.shape
    if min(height, width) < SMALL_PX:
        return _reflected(mosaic, code)
    rgb = as_image(cv2.cvtColor(mosaic, code))  # here OpenCV replaces each border by what lies beside it
    bottom, right = (height - 3) // 2 * 2, (width - 3) // 2 * 2  # where a strip begins as the mosaic does
    rgb[0], rgb[-1] = _reflected(mosaic[:4], code)[0], _reflected(mosaic[bottom:], code)[-1]
    rgb[:, 0] = _reflected(mosaic[:, :4], code)[:, 0]
    rgb[:, -1] = _reflected(mosaic[:, right:], code)[:, -1]
    return rgb


def _reflected(mosaic: Image, code: int) -> Image:
    """Return a mosaic as RGB, as if it were reflected at its borders."""
    reflected = cv2.copyMakeBorder(mosaic, *(REFLECTED_PX,) * 4, cv2.BORDER_REFLECT_101)
    inner = slice(REFLECTED_PX, -REFLECTED_PX)
    return as_image(np.ascontiguousarray(cv2.cvtColor(reflected, code)[inner, inner]))


def as_image(pixels: object) -> Image:
    """Return an array of OpenCV as a picture of 8 or 16 bits."""
    found = np.asarray(pixels)
    if found.dtype == np.uint8:
        return found.astype(np.uint8, copy=False)
    return found.astype(np.uint16, copy=False)


def to_eight_bits(image: Image, *, bits: int) -> NDArray[np.uint8]:
    """Return a picture in eight bits: full scale stays full scale."""
    if image.dtype == np.uint8:
        return image.astype(np.uint8, copy=False)
    full = FULL_12 if bits == 12 else (1 << bits) - 1
    table = np.clip(np.arange(1 << 16, dtype=np.float64) * 255.0 / full + 0.5, 0.0, 255.0).astype(np.uint8)
    return table[image]
