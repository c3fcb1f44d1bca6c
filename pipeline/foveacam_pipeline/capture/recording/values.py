"""What a recording holds: formats of streams, frames with the pose of their exposure, tracked boxes.

The names on the file are those of the authors' application, so that its reader and viewer open our files.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Image, InvalidInput, MirrorVolts, Role

SUFFIX, OLDER_SUFFIX = ".fcap", ".fovea"
PROFILE = "fovea"
RAW_ENCODING, RAW_SCHEMA = "x-fovea-raw", "fovea.raw_frame/v1"
TELEMETRY, TELEMETRY_SCHEMA = "telemetry", "fovea.frame_meta/v1"
DESCRIPTOR_PREFIX, DESCRIPTOR_SCHEMA = "fovea/", "fovea.descriptor/v1"
ZLIB_SUFFIX = "/zlib"
STREAM_OF_ROLE = {Role.LEFT: "left", Role.WIDE: "center", Role.RIGHT: "right"}
"""What our own recordings call the cameras."""
ITEM_BYTES = {"U8": 1, "U16": 2}
LARGEST_SIDE = 65_536


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamFormat:
    """How the frames of one stream lie on the file.

    `pixel_format`: GenICam's name. `dtype`: U8 or U16; U8 with a name that ends in 12p is packed. `bits`:
    significant ones of a pixel. `compressed`: every message is one zlib stream.
    """

    pixel_format: str
    dtype: str
    height: int
    width: int
    channels: int
    bits: int
    compressed: bool = False

    @property
    def packed(self) -> bool:
        """Whether two pixels of twelve bits lie in three bytes."""
        return self.pixel_format.endswith("12p") and self.dtype == "U8"

    @property
    def row_bytes(self) -> int:
        """Length of a row, bytes."""
        if self.packed:
            return math.ceil(12 * self.width / 8)
        return self.width * self.channels * ITEM_BYTES[self.dtype]

    @property
    def frame_bytes(self) -> int:
        """Length of a frame before any compression, bytes."""
        if self.packed:
            return math.ceil(12 * self.width * self.height / 8)
        return self.row_bytes * self.height

    def metadata(self) -> dict[str, str]:
        """Return it as the channel's metadata."""
        shape = [self.height, self.width] + ([self.channels] if self.channels > 1 else [])
        return {
            "dtype": self.dtype,
            "shape": json.dumps(shape),
            "width": str(self.width),
            "height": str(self.height),
            "channels": str(self.channels),
            "pixelFormat": self.pixel_format + (ZLIB_SUFFIX if self.compressed else ""),
            "significantBits": str(self.bits),
            "stride": str(self.row_bytes),
        }

    @classmethod
    def of_metadata(cls, found: Mapping[str, str], *, what: str) -> "StreamFormat":
        """Return what a channel's metadata says; raise `InvalidInput` when it makes no picture."""
        try:
            shape = [int(side) for side in json.loads(found["shape"])]
            name = found["pixelFormat"]
            dtype, plain_name = found["dtype"], name.removesuffix(ZLIB_SUFFIX)
            height, width = shape[:2]
            channels = shape[2] if len(shape) == 3 else 1
            whole = 8 * ITEM_BYTES[dtype]
            bits = int(found.get("significantBits") or whole)
        except (KeyError, ValueError, TypeError) as error:
            raise InvalidInput(
                f"{what}: its format cannot be read ({type(error).__name__}: {error}); it is no stream of"
                " raw frames, or the file is damaged"
            ) from error
        if not (0 < height <= LARGEST_SIDE and 0 < width <= LARGEST_SIDE and channels in (1, 3, 4)):
            raise InvalidInput(f"{what}: a picture of shape {shape} cannot be; the file is damaged")
        return cls(
            pixel_format=plain_name,
            dtype=dtype,
            height=height,
            width=width,
            channels=channels,
            bits=bits,
            compressed=name != plain_name,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FramePose:
    """What was known of one exposure besides its picture; None where nobody knew.

    `volts_source`: `fin-averaged` (over the exposure), `history-interpolated` or `live-snapshot`.
    `angles_rad`: (ax, ay) of the gaze. `wide_from_fovea`: (3, 3), raw fovea px to undistorted wide px.
    """

    frame_id: int | None = None
    volts: MirrorVolts | None = None
    volts_source: str | None = None
    angles_rad: tuple[float, float] | None = None
    wide_from_fovea: NDArray[np.float64] | None = None
    exposure_ns: int | None = None


NO_POSE = FramePose()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawFrame:
    """One frame on its way to the file: `payload` is contiguous and no longer written to by anybody."""

    payload: NDArray[np.uint8] | NDArray[np.uint16]
    form: StreamFormat
    seq: int
    t_ns: int
    pose: FramePose = NO_POSE

    def of_form(self, form: StreamFormat, payload: NDArray[np.uint8]) -> "RawFrame":
        """Return the same frame, its payload written another way."""
        return replace(self, form=form, payload=payload)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedFrame:
    """One frame of a recording.

    `image`: (h, w) grey or (h, w, 3) RGB, uint8, or uint16 with `bits` significant bits; a mosaic was made
    RGB. `raw`: the pixels as they were recorded, unpacked and else unchanged: a mosaic is (h, w), and what
    was recorded as grey or RGB is `image` itself. `t_ns`: on the recording's own monotonic clock.
    """

    stream: str
    index: int
    seq: int
    t_ns: int
    image: Image
    raw: Image
    bits: int
    pose: FramePose = NO_POSE


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackedBox:
    """A tracked box: `bbox_px` is (x, y, width, height) in the wide picture.

    `frames`: the number of the frame that it was found with, of every stream that has one.
    """

    slot: str
    t_ns: int
    bbox_px: tuple[float, float, float, float] | None
    frames: Mapping[str, int | None] = field(default_factory=dict)


def role_of(stream: str) -> Role | None:
    """Return which eye a stream's name tells: center or wide, left, right; None for another one."""
    name = stream.lower()
    if "center" in name or "wide" in name:
        return Role.WIDE
    if "left" in name:
        return Role.LEFT
    return Role.RIGHT if "right" in name else None
