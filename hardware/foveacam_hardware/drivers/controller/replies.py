"""Replies to a request: its phases as they arrive, a refusal with its remedy, or a timeout."""

from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue

from foveacam_hardware.contract import DeviceFault, NotConnected, Timeout
from foveacam_hardware.wire.controller import BadPacket, Packet, PacketMethod, decode_packet
from foveacam_hardware.wire.controller_payloads import unpack_text

STALL_S = 0.05
"""Grace after a deadline for the reader to deliver what arrived while this process was stalled."""
MALFORMED = "Invalid packet"
"""The controller's refusal of a request of the wrong size, as after a lost byte."""
QUIET_POLL_S = 0.002
"""Polling period of links that know when no more answers will come."""

_REMEDIES = {
    "Strobe timeout": "check the strobe cables and that both cameras wait for triggers;"
    " the pulse must be shorter than the exposure, and the exposure shorter than pulse + 5 ms",
    "Cannot perform action: system is not enabled": "enable the mirrors first",
    "System disabled": "enable the mirrors and ask again",
}


@dataclass(frozen=True, slots=True)
class ReplyArrival:
    """A reply with its arrival time and the sending time of its request."""

    packet: Packet
    sent_ns: int
    t_ns: int

    @property
    def round_trip_ms(self) -> float:
        """Time from the request to this reply, ms."""
        return (self.t_ns - self.sent_ns) / 1e6


class PendingReply:
    """The replies to one request."""

    def __init__(self, request: Packet, sent_ns: int, *, quiet: Callable[[], bool | None]) -> None:
        self.request = request
        self.sent_ns = sent_ns
        self._quiet = quiet
        self._inbox: SimpleQueue[tuple[Packet, int] | NotConnected] = SimpleQueue()

    def put(self, item: tuple[Packet, int] | NotConnected) -> None:
        """Deliver a reply, or the reason why none will come (called by the reader)."""
        self._inbox.put(item)

    def wait(self, *, deadline_s: float) -> ReplyArrival:
        """Return the next phase's reply; raise `Timeout`, `NotConnected` or `ControllerRefusal` (REJ)."""
        request = self.request
        item = self._next(deadline_s) or self._next(min(STALL_S, deadline_s))
        if item is None:
            raise Timeout(
                f"controller: no answer to {request.method.name} {request.prop.name} within {deadline_s:g} s"
            )
        if isinstance(item, NotConnected):
            raise NotConnected(str(item)) from item
        packet, t_ns = item
        if packet.method is PacketMethod.REJ:
            text = unpack_text(packet.payload)
            remedy = _REMEDIES.get(text, "see the controller's protocol")
            raise ControllerRefusal(f"controller refused {request.prop.name}: '{text}'; {remedy}", text=text)
        return ReplyArrival(packet, self.sent_ns, t_ns)

    def _next(self, timeout_s: float) -> tuple[Packet, int] | NotConnected | None:
        """Return the next item within a time; stop early on a link on which no answer can come."""
        if self._quiet() is None:
            return self._get(timeout_s)
        while (item := self._get(QUIET_POLL_S)) is None:
            if self._quiet():
                return self._get(0.0)
        return item

    def _get(self, timeout_s: float) -> tuple[Packet, int] | NotConnected | None:
        try:
            return self._inbox.get(timeout=timeout_s)
        except Empty:
            return None


class ControllerRefusal(DeviceFault):
    """The controller answered REJ with `text`."""

    def __init__(self, message: str, *, text: str) -> None:
        super().__init__(message)
        self.text = text


def is_malformed_refusal(frame: bytes | None) -> bool:
    """Return whether a frame without a CRC is a refusal of a request of the wrong size."""
    try:
        packet = decode_packet(frame)
    except BadPacket:
        return False
    return packet.method is PacketMethod.REJ and unpack_text(packet.payload) == MALFORMED
