"""Packs and unpacks the payloads of the mirror controller's packets: fixed sizes, little endian.

A payload of another size raises `BadPacket`; the controller refuses it too.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import TypeAlias

from foveacam_hardware.wire.controller import BadPacket

MirrorCodes: TypeAlias = tuple[int, int, int, int]
"""DAC codes of one mirror: x+, x−, y+, y−."""

DAC_FULL_SCALE = 65_535
DAC_FULL_SCALE_V = 200.0

_STREAM = struct.Struct("<BB8H")
_ACTUATE = struct.Struct("<8HI")
_FRAME = struct.Struct("<BBII")
_FRAME_REPORT = struct.Struct("<BIQQ8H")
_GUARD = struct.Struct("<BI")
_U8 = struct.Struct("<B")
_U16 = struct.Struct("<H")
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")


class StreamOperation(IntEnum):
    """Operation of a STREAM packet."""

    CREATE = 0
    UPDATE = 1
    TERMINATE = 2


class ResetType(IntEnum):
    """Scope of a RESET packet."""

    SOFT = 0
    HARD = 1
    MIRROR_DACS = 2


class GuardItem(IntEnum):
    """Settings of a firmware with a guard that the host uses (firmware/README.md)."""

    WATCHDOG_MS = 2
    LARGEST_CODE = 5
    LARGEST_DIFFERENCE = 6
    CHECK = 9
    """0: checksum; 1: checksum and CRC."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamCommand:
    """Payload of STREAM, in either direction. `operation` is an int: the far end refuses unknown ones."""

    operation: int
    stream: int
    left: MirrorCodes
    right: MirrorCodes

    def pack(self) -> bytes:
        """Return the 18 payload bytes."""
        return _STREAM.pack(self.operation, self.stream, *self.left, *self.right)

    @classmethod
    def unpack(cls, payload: bytes) -> "StreamCommand":
        """Read the 18 payload bytes."""
        operation, stream, *codes = _unpack(_STREAM, payload)
        return cls(operation=operation, stream=stream, left=_mirror(codes[:4]), right=_mirror(codes[4:]))


@dataclass(frozen=True, slots=True, kw_only=True)
class ActuateCommand:
    """Payload of ACTUATE and its ACK; in the FIN `settle_us` holds the completion time instead."""

    left: MirrorCodes
    right: MirrorCodes
    settle_us: int

    def pack(self) -> bytes:
        """Return the 20 payload bytes."""
        return _ACTUATE.pack(*self.left, *self.right, self.settle_us)

    @classmethod
    def unpack(cls, payload: bytes) -> "ActuateCommand":
        """Read the 20 payload bytes."""
        *codes, settle_us = _unpack(_ACTUATE, payload)
        return cls(left=_mirror(codes[:4]), right=_mirror(codes[4:]), settle_us=settle_us)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameRequest:
    """Payload of a FRAME request; `cameras` is a mask, 0 = left and right."""

    stream: int
    cameras: int
    pulse_us: int
    settle_us: int

    def pack(self) -> bytes:
        """Return the 10 payload bytes."""
        return _FRAME.pack(self.stream, self.cameras, self.pulse_us, self.settle_us)

    @classmethod
    def unpack(cls, payload: bytes) -> "FrameRequest":
        """Read the 10 payload bytes."""
        stream, cameras, pulse_us, settle_us = _unpack(_FRAME, payload)
        return cls(stream=stream, cameras=cameras, pulse_us=pulse_us, settle_us=settle_us)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameReport:
    """Payload of a FRAME's FIN; times on the controller's clock, codes are means over the exposure.

    `t_exposure_start_us` is the protocol's `t_exposure`: the rising edge of the first strobe, not the middle.
    """

    stream: int
    frame_id: int
    t_trigger_us: int
    t_exposure_start_us: int
    left: MirrorCodes
    right: MirrorCodes

    def pack(self) -> bytes:
        """Return the 37 payload bytes."""
        return _FRAME_REPORT.pack(
            self.stream, self.frame_id, self.t_trigger_us, self.t_exposure_start_us, *self.left, *self.right
        )

    @classmethod
    def unpack(cls, payload: bytes) -> "FrameReport":
        """Read the 37 payload bytes."""
        stream, frame_id, t_trigger_us, t_exposure_start_us, *codes = _unpack(_FRAME_REPORT, payload)
        return cls(
            stream=stream,
            frame_id=frame_id,
            t_trigger_us=t_trigger_us,
            t_exposure_start_us=t_exposure_start_us,
            left=_mirror(codes[:4]),
            right=_mirror(codes[4:]),
        )


def pack_u8(value: int) -> bytes:
    """Return one byte."""
    return _pack(_U8, value)


def unpack_u8(payload: bytes) -> int:
    """Read one byte (ENABLE, LOG LEVEL, RESET, a FRAME's queue position)."""
    return _unpack(_U8, payload)[0]


def pack_u16(value: int) -> bytes:
    """Return two bytes."""
    return _pack(_U16, value)


def unpack_u16(payload: bytes) -> int:
    """Read two bytes (LPF in Hz, BIAS as a DAC code)."""
    return _unpack(_U16, payload)[0]


def pack_u32(value: int) -> bytes:
    """Return four bytes."""
    return _pack(_U32, value)


def unpack_u32(payload: bytes) -> int:
    """Read four bytes (TRIGGER: duration, then time, µs)."""
    return _unpack(_U32, payload)[0]


def pack_u64(value: int) -> bytes:
    """Return eight bytes."""
    return _pack(_U64, value)


def unpack_u64(payload: bytes) -> int:
    """Read eight bytes (TIMESTAMP, µs)."""
    return _unpack(_U64, payload)[0]


def pack_guard(item: GuardItem, value: int) -> bytes:
    """Return the 5 payload bytes of GUARD, the same for a setting, its acknowledgement and a reading."""
    try:
        return _GUARD.pack(item, value)
    except struct.error as failure:
        raise BadPacket(f"{value} does not fit into guard item {item.name}") from failure


def pack_version(version: tuple[int, int, int]) -> bytes:
    """Return the three bytes of VERSION."""
    return bytes(version)


def unpack_version(payload: bytes) -> tuple[int, int, int]:
    """Read the three bytes of VERSION."""
    if len(payload) != 3:
        raise BadPacket(f"a version of {len(payload)} bytes; 3 are due")
    return payload[0], payload[1], payload[2]


def unpack_text(payload: bytes) -> str:
    """Read ASCII text (INFO, LOG, REJ); other bytes are shown as escapes."""
    return payload.decode("ascii", errors="backslashreplace")


def code_of_volts(volts_v: float) -> int:
    """Return the DAC code of a channel voltage, 0..200 V, truncated as the controller's tables do."""
    return int(DAC_FULL_SCALE * volts_v / DAC_FULL_SCALE_V)


def _pack(layout: struct.Struct, value: int) -> bytes:
    try:
        return layout.pack(value)
    except struct.error as failure:
        raise BadPacket(f"{value} does not fit into {layout.size} bytes") from failure


def _unpack(layout: struct.Struct, payload: bytes) -> tuple[int, ...]:
    if len(payload) != layout.size:
        raise BadPacket(f"a payload of {len(payload)} bytes; {layout.size} are due")
    return layout.unpack(payload)


def _mirror(codes: list[int]) -> MirrorCodes:
    x_plus, x_minus, y_plus, y_minus = codes
    return x_plus, x_minus, y_plus, y_minus
