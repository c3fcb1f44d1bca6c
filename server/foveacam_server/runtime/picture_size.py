"""How large a PNG or a JPEG says it is, read without unpacking it: a small file may unpack to gigabytes."""

import struct

from foveacam_hardware.contract import InvalidInput

_PNG = b"\x89PNG\r\n\x1a\n"
_SIZED = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""JPEG's frame headers; the other three of that range are tables (ITU-T T.81, Table B.1)."""


def picture_size(content: bytes) -> tuple[int, int]:
    """Return width and height, px; raise InvalidInput for what is neither PNG nor JPEG, or cut short."""
    if content.startswith(_PNG):
        size = _png_size(content)
    elif content.startswith(b"\xff\xd8"):
        size = _jpeg_size(content)
    else:
        raise InvalidInput("the picture is neither PNG nor JPEG; save it as one of them")
    if size is None or min(size) < 1:
        raise InvalidInput("the picture does not say how large it is: it may be cut short; save it again")
    return size


def _png_size(content: bytes) -> tuple[int, int] | None:
    if len(content) < 24 or content[12:16] != b"IHDR":
        return None
    width, height = struct.unpack(">II", content[16:24])
    return width, height


def _jpeg_size(content: bytes) -> tuple[int, int] | None:
    at = 2
    while at + 9 <= len(content) and content[at] == 0xFF:
        kind = content[at + 1]
        if kind == 0xFF:  # padding
            at += 1
        elif kind in _SIZED:
            height, width = struct.unpack(">HH", content[at + 5 : at + 9])
            return width, height
        else:
            at += 2 + int.from_bytes(content[at + 2 : at + 4])
    return None
