"""Parks a controller whose host is gone: bias on both mirrors, then rail off, verified."""

import time
from dataclasses import dataclass

from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    BadPacket,
    Packet,
    PacketMethod,
    PacketProperty,
    decode_packet,
    encode_packet,
)
from foveacam_hardware.wire.controller_payloads import pack_u8
from foveacam_hardware.wire.guardian import ParkingPlan
from foveacam_hardware.wire.open_file import OpenPort

BUDGET_S = 0.9
"""Total time; the mirrors must be off within a second."""
ANSWER_S = 0.12
FIRST_SEQUENCE = 0xFF00
"""First sequence number, above those of most sessions; a reply meant for the host would do no harm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParkingOutcome:
    """Result of parking."""

    rail_off: bool
    detail: str


def park_and_disable(port: OpenPort, plan: ParkingPlan) -> ParkingOutcome:
    """Park, let the mirrors settle, and switch the rail off; repeat while nothing answers.

    The host may have died in the middle of a packet, which our first packet then completes and is lost with.
    So everything is sent at least twice.
    """
    deadline_s = time.monotonic() + BUDGET_S
    rail = _EnableRequests(port)
    try:
        port.write(plan.rest)
        port.wait(min(plan.settle_ms * 1e-3, 0.1))
        tries = 0
        while time.monotonic() < deadline_s:
            tries += 1
            if rail.switch_off():
                return ParkingOutcome(rail_off=True, detail=f"mirrors parked, rail off (asked {tries} times)")
            port.write(plan.rest)
    except OSError as failure:
        return ParkingOutcome(rail_off=False, detail=f"the port failed ({failure})")
    return ParkingOutcome(
        rail_off=False,
        detail="the controller does not answer: switch its supply off and on, the mirror rail may be on",
    )


class _EnableRequests:
    """Requests of the ENABLE property and their replies; everything else is ignored."""

    def __init__(self, port: OpenPort) -> None:
        self._port = port
        self._decoder = CobsDecoder()
        self._sequence = FIRST_SEQUENCE

    def switch_off(self) -> bool:
        """Switch the rail off; return whether the controller confirms that it is."""
        off = self._ask(PacketMethod.SET, pack_u8(0))
        return off == pack_u8(0) and self._ask(PacketMethod.GET) == pack_u8(0)

    def _ask(self, method: PacketMethod, payload: bytes = b"") -> bytes | None:
        self._sequence += 1
        self._port.write(encode_packet(Packet(method, PacketProperty.ENABLE, self._sequence, payload)))
        deadline_s = time.monotonic() + ANSWER_S
        while (left_s := deadline_s - time.monotonic()) > 0:
            for frame in self._decoder.feed(self._port.read(left_s)):
                reply = self._reply(frame)
                if reply is not None:
                    return reply.payload
        return None

    def _reply(self, frame: bytes | None) -> Packet | None:
        try:
            packet = decode_packet(frame)
        except BadPacket:
            return None
        ours = packet.prop is PacketProperty.ENABLE and packet.sequence == self._sequence
        return packet if ours and packet.method is PacketMethod.ACK else None
