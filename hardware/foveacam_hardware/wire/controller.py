"""Packets of the mirror controller: methods, properties, checksum, sequence numbers.

Payloads are in `controller_payloads`. Specification: the controller's protocol page, version 2.1. The CRC is
an extension of the firmware with a guard (firmware/README.md), used only once both sides have agreed on it.
"""

import binascii
from dataclasses import dataclass
from enum import IntEnum
from functools import reduce
from operator import xor

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.wire.cobs import cobs_encode

USB_VENDOR_ID = 0x16C0
USB_PRODUCT_ID = 0x0483
MAX_PACKET_BYTES = 254
MAX_SEQUENCE = 0xFFFF
SILENT = 0
"""Sequence number of a request that the controller executes without a reply."""
_HEADER_BYTES = 4
_CRC_BYTES = 2
_CRC_START = 0xFFFF


class PacketMethod(IntEnum):
    """Method of a packet."""

    NOP = 0x0
    GET = 0x1
    SET = 0x2
    ACK = 0x3
    REJ = 0x4
    FIN = 0x5
    SYN = 0xF


class PacketProperty(IntEnum):
    """Property that a packet addresses."""

    NONE = 0x0
    INFO = 0x1
    VERSION = 0x2
    RESET = 0x3
    ENABLE = 0x4
    LOG_LEVEL = 0x5
    LPF = 0x6
    BIAS = 0x7
    STREAM = 0x8
    FRAME = 0x9
    ACTUATE = 0xA
    TRIGGER = 0xB
    TIMESTAMP = 0xC
    GUARD = 0xD
    VOLTS = 0xE
    LOG = 0xF


GUARDED_ONLY = frozenset({PacketProperty.GUARD, PacketProperty.VOLTS})
"""Properties that only a firmware with a guard implements."""
TWO_PHASE = frozenset({PacketProperty.ACTUATE, PacketProperty.TRIGGER, PacketProperty.FRAME})
"""Properties whose requests are acknowledged first (ACK) and finished later (FIN)."""


class BadPacket(DeviceFault):
    """Bytes that are not a packet of this protocol."""


class BadChecksum(BadPacket):
    """A packet with a wrong checksum: the XOR of its bytes is not zero."""


class BadCrc(BadPacket):
    """A packet with a correct checksum and a wrong or missing CRC."""


@dataclass(frozen=True, slots=True)
class Packet:
    """One message, in either direction."""

    method: PacketMethod
    prop: PacketProperty
    sequence: int
    payload: bytes = b""


def encode_packet(packet: Packet, *, crc: bool = False) -> bytes:
    """Return the wire bytes of a packet: checksum, header, payload, optional CRC; stuffed and delimited."""
    if not 0 <= packet.sequence <= MAX_SEQUENCE:
        raise BadPacket(f"sequence {packet.sequence} is outside 0..{MAX_SEQUENCE}")
    header = bytes((packet.method << 4 | packet.prop,)) + packet.sequence.to_bytes(2, "little")
    body = header + packet.payload
    if crc:
        body += crc16(body)
    if len(body) + 1 > MAX_PACKET_BYTES:
        raise BadPacket(f"a packet of {len(body) + 1} bytes exceeds {MAX_PACKET_BYTES}")
    return cobs_encode(bytes((reduce(xor, body),)) + body)


def decode_packet(frame: bytes | None, *, crc: bool = False) -> Packet:
    """Return the packet of one unstuffed frame (None = malformed stuffing); raise `BadPacket`.

    `crc`: whether it must carry a CRC; raise `BadCrc` when only the CRC is wrong or missing.
    """
    if frame is None:
        raise BadPacket("malformed stuffing")
    if not _HEADER_BYTES <= len(frame) <= MAX_PACKET_BYTES:
        raise BadPacket(f"a frame of {len(frame)} bytes is no packet (4..{MAX_PACKET_BYTES})")
    if reduce(xor, frame):
        raise BadChecksum(f"checksum of {frame.hex(' ')} is wrong")
    if crc:
        frame = _without_crc(frame)
    try:
        method, prop = PacketMethod(frame[1] >> 4), PacketProperty(frame[1] & 0xF)
    except ValueError as unknown:
        raise BadPacket(f"unknown method or property 0x{frame[1]:02x}") from unknown
    return Packet(method, prop, int.from_bytes(frame[2:4], "little"), frame[4:])


def crc16(data: bytes) -> bytes:
    """Return CRC-16/CCITT-FALSE (polynomial 1021, start FFFF), little endian."""
    return binascii.crc_hqx(data, _CRC_START).to_bytes(_CRC_BYTES, "little")


def _without_crc(frame: bytes) -> bytes:
    body, found = frame[:-_CRC_BYTES], frame[-_CRC_BYTES:]
    if len(body) < _HEADER_BYTES or crc16(body[1:]) != found:
        raise BadCrc(f"CRC of {frame.hex(' ')} is wrong or missing")
    return body


def next_sequence(sequence: int) -> int:
    """Return the sequence number after `sequence`: 1..65535, wrapping past 0."""
    return sequence % MAX_SEQUENCE + 1
