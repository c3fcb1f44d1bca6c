"""The value types of a recording: stream formats, streams, frames with their poses, tracked boxes.

The names in the file are those of the authors' application, so that its reader and viewer open our files.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Binning, Image, InvalidInput, MirrorVolts, Role

SUFFIX, OLD_SUFFIX = ".fcap", ".fovea"
PROFILE = "fovea"
RAW_ENCODING, RAW_SCHEMA = "x-fovea-raw", "fovea.raw_frame/v1"
TELEMETRY, TELEMETRY_SCHEMA = "telemetry", "fovea.frame_meta/v1"
DESCRIPTOR_PREFIX, DESCRIPTOR_SCHEMA = "fovea/", "fovea.descriptor/v1"
ZLIB_SUFFIX = "/zlib"
STREAM_OF_ROLE = {Role.LEFT: "left", Role.WIDE: "center", Role.RIGHT: "right"}
"""Stream names of the cameras in our own recordings."""
ITEM_BYTES = {"U8": 1, "U16": 2}
LARGEST_SIDE = 65_536


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamFormat:
    """The storage format of the frames of one stream.

    `pixel_format`: GenICam's name. `dtype`: U8 or U16; U8 with a name that ends in 12p is packed. `bits`:
    significant bits of a pixel. `compressed`: every message is one zlib stream. `binning`: of the camera; a
    stream has one, and frames of another are refused as those of another size are.
    """

    pixel_format: str
    dtype: str
    height: int
    width: int
    channels: int
    bits: int
    compressed: bool = False
    binning: Binning = 1

    @property
    def packed(self) -> bool:
        """Whether two pixels of twelve bits are packed into three bytes."""
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
        """Return the format as the channel's metadata."""
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
            **({} if self.binning == 1 else {"binning": str(self.binning)}),
        }

    @classmethod
    def of_metadata(cls, found: Mapping[str, str], *, what: str) -> "StreamFormat":
        """Return the format of a channel's metadata; raise `InvalidInput` when it is invalid."""
        try:
            shape = [int(side) for side in json.loads(found["shape"])]
            name = found["pixelFormat"]
            dtype, plain_name = found["dtype"], name.removesuffix(ZLIB_SUFFIX)
            height, width = shape[:2]
            channels = shape[2] if len(shape) == 3 else 1
            whole = 8 * ITEM_BYTES[dtype]
            bits = int(found.get("significantBits") or whole)
            binning: Binning = 2 if int(found.get("binning", 1)) == 2 else 1
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
            binning=binning,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedStream:
    """One camera of a recording; `t_ns`: (n,) int64, ascending, the recording's monotonic clock."""

    name: str
    role: Role | None
    form: StreamFormat
    t_ns: NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.t_ns)

    @property
    def fps(self) -> float:
        """Mean rate, Hz; 0 when there are too few frames."""
        span_ns = int(self.t_ns[-1] - self.t_ns[0]) if len(self) > 1 else 0
        return (len(self) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FramePose:
    """The volts, gaze and exposure of one frame; None where unknown.

    `volts_source`: `fin-averaged` (over the exposure), `history-interpolated` or `live-snapshot`.
    `angles_rad`: (ax, ay) of the gaze. `wide_from_fovea`: (3, 3), fovea px to undistorted wide px, of
    the sensors.
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
    """One frame to be written: `payload` is contiguous and no longer changed by anybody."""

    payload: NDArray[np.uint8] | NDArray[np.uint16]
    form: StreamFormat
    seq: int
    t_ns: int
    pose: FramePose = NO_POSE

    def with_payload(self, form: StreamFormat, payload: NDArray[np.uint8]) -> "RawFrame":
        """Return the same frame with its payload in another format."""
        return replace(self, form=form, payload=payload)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedFrame:
    """One frame of a recording.

    `image`: (h, w) grey or (h, w, 3) RGB, uint8, or uint16 with `bits` significant bits; a mosaic is
    converted to RGB. `raw`: the pixels as recorded, only unpacked: a mosaic is (h, w), and recorded grey or
    RGB is `image` itself. `t_ns`: on the recording's own monotonic clock.
    """

    stream: str
    index: int
    seq: int
    t_ns: int
    image: Image
    raw: Image
    bits: int
    pose: FramePose = NO_POSE
    binning: Binning = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackedBox:
    """A tracked box: `bbox_px` is (x, y, width, height) in the wide image, px of its sensor.

    `frames`: the number of the frame in which it was found, for every stream that has one.
    """

    slot: str
    t_ns: int
    bbox_px: tuple[float, float, float, float] | None
    frames: Mapping[str, int | None] = field(default_factory=dict)


def role_of(stream: str) -> Role | None:
    """Return the role that a stream's name states: center or wide, left, right; None for any other name."""
    name = stream.lower()
    if "center" in name or "wide" in name:
        return Role.WIDE
    if "left" in name:
        return Role.LEFT
    return Role.RIGHT if "right" in name else None


def nearest_index(times_ns: NDArray[np.int64], t_ns: int) -> int:
    """Return the index of the nearest time; `times_ns` is ascending and not empty."""
    after = int(np.searchsorted(times_ns, t_ns))
    before = max(0, after - 1)
    after = min(after, len(times_ns) - 1)
    return before if abs(int(times_ns[before]) - t_ns) <= abs(int(times_ns[after]) - t_ns) else after
