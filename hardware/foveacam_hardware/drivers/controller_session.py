"""One open link to the controller: its reader thread, requests matched to replies, traffic counted.

Knows packets and deadlines; what the requests mean is `controller_dialogue`'s and the driver's.
"""

import logging
import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TypeAlias

from foveacam_hardware.contract import Clock, DeviceFault, LinkTelemetry, NotConnected, Timeout
from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    SILENT,
    BadPacket,
    Method,
    Packet,
    Property,
    decode_packet,
    encode_packet,
    next_sequence,
)
from foveacam_hardware.wire.controller_payloads import unpack_text
from foveacam_hardware.wire.link import Link

logger = logging.getLogger(__name__)

POLL_S = 0.05
"""How long the reader may stay deaf to `close`."""
STALL_S = 0.05
"""After a deadline the reader gets this long to hand over what arrived while this process was stalled."""
Message: TypeAlias = tuple[Method, Property, bytes]
"""A request before it has a sequence number."""

_LOG_LEVELS = {"[ERROR]": logging.ERROR, "[WARN]": logging.WARNING, "[VERBOSE]": logging.DEBUG}
_SLOW = frozenset({Property.ENABLE, Property.RESET})
_REMEDIES = {
    "Strobe timeout": "check the strobe cables and that both cameras wait for triggers;"
    " the pulse must be shorter than the exposure, and the exposure shorter than pulse + 5 ms",
    "Cannot perform action: system is not enabled": "enable the mirrors first",
    "System disabled": "enable the mirrors and ask again",
}


NO_TRAFFIC = LinkTelemetry(
    tx_packets=0,
    rx_packets=0,
    tx_bytes=0,
    rx_bytes=0,
    bad_packets=0,
    rtt_p50_ms=0.0,
    rtt_p99_ms=0.0,
    clock_offset_ns=0,
)


@dataclass(frozen=True, slots=True)
class Arrival:
    """A reply, when it came and when its request was sent."""

    packet: Packet
    sent_ns: int
    t_ns: int

    @property
    def round_trip_ms(self) -> float:
        """Time from the request to this reply."""
        return (self.t_ns - self.sent_ns) / 1e6


class Reply:
    """What comes back for one request."""

    def __init__(self, request: Packet, sent_ns: int) -> None:
        self.request = request
        self.sent_ns = sent_ns
        self._inbox: SimpleQueue[tuple[Packet, int] | NotConnected] = SimpleQueue()

    def put(self, item: tuple[Packet, int] | NotConnected) -> None:
        """Hand over a reply, or the reason why none will come (called by the reader)."""
        self._inbox.put(item)

    def wait(self, *, deadline_s: float) -> Arrival:
        """Return the next phase's reply; raise `Timeout`, `NotConnected`, or `Refusal` with REJ's text."""
        request = self.request
        item = self._next(deadline_s) or self._next(STALL_S)
        if item is None:
            raise Timeout(
                f"controller: no answer to {request.method.name} {request.prop.name} within {deadline_s:g} s"
            )
        if isinstance(item, NotConnected):
            raise NotConnected(str(item)) from item
        packet, t_ns = item
        if packet.method is Method.REJ:
            text = unpack_text(packet.payload)
            remedy = _REMEDIES.get(text, "see the controller's protocol")
            raise Refusal(f"controller refused {request.prop.name}: '{text}'; {remedy}", text=text)
        return Arrival(packet, self.sent_ns, t_ns)

    def _next(self, timeout_s: float) -> tuple[Packet, int] | NotConnected | None:
        try:
            return self._inbox.get(timeout=timeout_s)
        except Empty:
            return None


class Refusal(DeviceFault):
    """The controller answered REJ with `text`."""

    def __init__(self, message: str, *, text: str) -> None:
        super().__init__(message)
        self.text = text


class Session:
    """An open link with exactly one reader thread."""

    def __init__(self, link: Link, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._lock = threading.Lock()  # sequence, waiting replies, counters and the write itself
        self._waiting: dict[int, Reply] = {}
        self._sequence = 0
        self._decoder = CobsDecoder()
        self._round_trips_ms: deque[float] = deque(maxlen=1000)
        self._tx_packets = self._tx_bytes = 0
        self._rx_packets = self._rx_bytes = self._bad_packets = 0
        self.failure: NotConnected | None = None
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="controller-reader", daemon=True)
        self._reader.start()

    def begin(self, *messages: Message) -> list[Reply]:
        """Send requests in one write; return their replies to be."""
        with self._lock:
            replies = []
            for method, prop, payload in messages:
                self._sequence = next_sequence(self._sequence)
                packet = Packet(method, prop, self._sequence, payload)
                replies.append(Reply(packet, self._clock.now_ns()))
            self._waiting.update((reply.request.sequence, reply) for reply in replies)
            self._write([reply.request for reply in replies])
        return replies

    def post(self, *messages: Message) -> None:
        """Send requests that the controller acts on without a reply."""
        with self._lock:
            self._write([Packet(method, prop, SILENT, payload) for method, prop, payload in messages])

    def forget(self, reply: Reply) -> None:
        """Wait no longer for a reply; one that still comes is dropped."""
        with self._lock:
            self._waiting.pop(reply.request.sequence, None)

    def fail(self, failure: NotConnected) -> None:
        """Declare the link lost: every waiting request ends at once."""
        with self._lock:
            self._fail(failure)

    def close(self) -> None:
        """Stop the reader and release the link; harmless when closed."""
        self._closing.set()
        if self._reader is not threading.current_thread():
            self._reader.join()
        self.fail(NotConnected("controller: the link was closed; connect again"))
        self._link.close()

    def telemetry(self, *, clock_offset_ns: int) -> LinkTelemetry:
        """Return the traffic so far."""
        with self._lock:
            ordered = sorted(self._round_trips_ms)
            return LinkTelemetry(
                tx_packets=self._tx_packets,
                rx_packets=self._rx_packets,
                tx_bytes=self._tx_bytes,
                rx_bytes=self._rx_bytes,
                bad_packets=self._bad_packets,
                rtt_p50_ms=_quantile(ordered, 0.5),
                rtt_p99_ms=_quantile(ordered, 0.99),
                clock_offset_ns=clock_offset_ns,
            )

    def _write(self, packets: Sequence[Packet]) -> None:
        if self.failure is not None:
            raise NotConnected(str(self.failure)) from self.failure
        data = b"".join(encode_packet(packet) for packet in packets)
        try:
            self._link.write(data)
        except NotConnected as lost:
            self._fail(lost)
            raise
        self._tx_packets += len(packets)
        self._tx_bytes += len(data)

    def _fail(self, failure: NotConnected) -> None:
        if self.failure is None:
            self.failure = failure
        for reply in self._waiting.values():
            reply.put(failure)
        self._waiting.clear()

    def _read(self) -> None:
        try:
            while not self._closing.is_set() and self.failure is None:
                data = self._link.read(POLL_S)
                if data:
                    self._take(data, self._clock.now_ns())
        except NotConnected as lost:
            self.fail(lost)
        except Exception as bug:  # outermost frame of the thread: nobody may wait for a dead reader
            logger.exception("the controller's reader thread stopped")
            self.fail(NotConnected(f"controller: the reader stopped ({bug}); connect again"))

    def _take(self, data: bytes, t_ns: int) -> None:
        self._rx_bytes += len(data)
        for frame in self._decoder.feed(data):
            try:
                packet = decode_packet(frame)
            except BadPacket as bad:
                # Replies to malformed packets are noise with a wrong checksum (protocol page, fault 2).
                self._bad_packets += 1
                logger.debug("dropped a bad packet: %s", bad)
                continue
            self._rx_packets += 1
            self._dispatch(packet, t_ns)

    def _dispatch(self, packet: Packet, t_ns: int) -> None:
        if packet.prop is Property.LOG:
            text = unpack_text(packet.payload)
            level = next(
                (level for mark, level in _LOG_LEVELS.items() if text.startswith(mark)), logging.INFO
            )
            logger.log(level, "controller: %s", text)
            return
        with self._lock:
            reply = self._waiting.get(packet.sequence)
            if reply is None or packet.prop is not reply.request.prop:
                logger.debug("nobody waits for %s", packet)
                return
            if packet.method is Method.ACK and packet.prop not in _SLOW:
                self._round_trips_ms.append((t_ns - reply.sent_ns) / 1e6)
            reply.put((packet, t_ns))


def _quantile(ordered: Sequence[float], fraction: float) -> float:
    return ordered[min(len(ordered) - 1, int(fraction * len(ordered)))] if ordered else 0.0
