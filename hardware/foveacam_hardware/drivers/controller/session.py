"""One open link to the controller: its reader thread, requests matched to replies, traffic counted.

Knows packets and deadlines; what the requests mean is `dialogue`'s and the driver's.
"""

import contextlib
import logging
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import TypeAlias

from foveacam_hardware.contract import Clock, DeviceFault, LinkTelemetry, NotConnected, Timeout
from foveacam_hardware.drivers.controller.traffic import Traffic
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
from foveacam_hardware.wire.link import Backlog, PortLink
from foveacam_hardware.wire.usb_ports import PortIdentity

logger = logging.getLogger(__name__)

POLL_S = 0.05
"""How long the reader may stay deaf to `close`."""
STRANGE_BYTES = 64
"""How much is kept of what a port says that is no packet."""
STALL_S = 0.05
"""After a deadline the reader gets this long to hand over what arrived while this process was stalled."""
Message: TypeAlias = tuple[Method, Property, bytes]
"""A request before it has a sequence number."""

_LOG_LEVELS = {"[ERROR]": logging.ERROR, "[WARN]": logging.WARNING, "[VERBOSE]": logging.DEBUG}
_REPLIES = frozenset({Method.ACK, Method.REJ, Method.FIN})
_REMEDIES = {
    "Strobe timeout": "check the strobe cables and that both cameras wait for triggers;"
    " the pulse must be shorter than the exposure, and the exposure shorter than pulse + 5 ms",
    "Cannot perform action: system is not enabled": "enable the mirrors first",
    "System disabled": "enable the mirrors and ask again",
}


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
        item = self._next(deadline_s) or self._next(min(STALL_S, deadline_s))
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

    def __init__(self, link: PortLink, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._lock = threading.Lock()  # sequence, waiting replies, counters and the write itself
        self._waiting: dict[int, Reply] = {}
        self._unanswered: set[int] = set()
        self._answered = threading.Condition(self._lock)
        self._sequence = 0
        self._decoder = CobsDecoder()
        self._traffic = Traffic()
        self._strange = b""
        self._sent_ns = clock.now_ns()
        self._heartbeat_ns: int | None = None
        self.echoes = False
        """Whether what we say comes back: no controller does that."""
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
            self._unanswered |= {reply.request.sequence for reply in replies}
            self._write([reply.request for reply in replies])
        return replies

    def post(self, *messages: Message) -> None:
        """Send requests that the controller acts on without a reply."""
        with self._lock:
            self._write([Packet(method, prop, SILENT, payload) for method, prop, payload in messages])

    def forget(self, *replies: Reply) -> None:
        """Wait no longer for replies; one that still comes is dropped."""
        with self._lock:
            for reply in replies:
                self._waiting.pop(reply.request.sequence, None)
                self._settle(reply.request.sequence)

    @property
    def pending(self) -> bool:
        """Whether a request waits for its first reply."""
        return bool(self._unanswered)

    def wait_answered(self, timeout_s: float) -> None:
        """Return once no request waits for its first reply, or the time is over."""
        with self._answered:
            self._answered.wait_for(lambda: not self._unanswered, timeout_s)

    def beat(self, period_ns: int) -> None:
        """Say something at least this often from now on: a controller with a watchdog parks without."""
        self._heartbeat_ns = period_ns

    @property
    def strange(self) -> bytes:
        """The beginning of what the port has said, while it never was a packet."""
        return self._strange

    @property
    def identity(self) -> PortIdentity:
        """Which port it is."""
        return self._link.identity

    @property
    def file(self) -> int | None:
        """The open port, to hand over."""
        return self._link.file

    def backlog(self) -> Backlog:
        """Return what waits to go out."""
        return self._link.backlog()

    def recent_p95_ms(self) -> float | None:
        """Return how slow acknowledgements are now; None when there were none in the last second."""
        with self._lock:
            return self._traffic.recent_p95_ms(self._clock.now_ns())

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

    def telemetry(self) -> LinkTelemetry:
        """Return the traffic so far; clock and governor are the driver's to add."""
        queued_bytes = self._link.backlog().queued_bytes
        with self._lock:
            return self._traffic.telemetry(self._clock.now_ns(), queued_bytes=queued_bytes)

    def _write(self, packets: Sequence[Packet]) -> None:
        if self.failure is not None:
            raise NotConnected(str(self.failure)) from self.failure
        data = b"".join(encode_packet(packet) for packet in packets)
        try:
            self._link.write(data)
        except NotConnected as lost:
            self._fail(lost)
            raise
        self._sent_ns = self._clock.now_ns()
        self._traffic.sent(packets, size=len(data), t_ns=self._sent_ns)

    def _fail(self, failure: NotConnected) -> None:
        if self.failure is None:
            self.failure = failure
        for reply in self._waiting.values():
            reply.put(failure)
        self._waiting.clear()
        self._unanswered.clear()
        self._answered.notify_all()

    def _settle(self, sequence: int) -> None:
        self._unanswered.discard(sequence)
        if not self._unanswered:
            self._answered.notify_all()

    def _read(self) -> None:
        try:
            while not self._closing.is_set() and self.failure is None:
                data = self._link.read(POLL_S)
                if data:
                    self._take(data, self._clock.now_ns())
                self._beat_if_due()
        except NotConnected as lost:
            self.fail(lost)
        except Exception as bug:  # outermost frame of the thread: nobody may wait for a dead reader
            logger.exception("the controller's reader thread stopped")
            self.fail(NotConnected(f"controller: the reader stopped ({bug}); connect again"))

    def _beat_if_due(self) -> None:
        if self._heartbeat_ns is None or self._clock.now_ns() - self._sent_ns < self._heartbeat_ns:
            return
        with contextlib.suppress(NotConnected):  # the next read tells
            self.post((Method.NOP, Property.NONE, b""))

    def _take(self, data: bytes, t_ns: int) -> None:
        with self._lock:
            self._traffic.received(len(data), t_ns)
        if self._traffic.rx_packets == 0:
            self._strange = (self._strange + data)[:STRANGE_BYTES]
        for frame in self._decoder.feed(data):
            try:
                packet = decode_packet(frame)
            except BadPacket as bad:
                # Replies to malformed packets are noise with a wrong checksum (protocol page, fault 2).
                self._traffic.bad_packets += 1
                logger.debug("dropped a bad packet: %s", bad)
                continue
            if packet.method not in _REPLIES and packet.prop is not Property.LOG:
                self.echoes = True
                continue
            self._dispatch(packet, t_ns)

    def _dispatch(self, packet: Packet, t_ns: int) -> None:
        with self._lock:
            self._traffic.taken(t_ns)
        self._strange = b""
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
            if packet.method is Method.ACK:
                self._traffic.acknowledged(packet.prop, sent_ns=reply.sent_ns, t_ns=t_ns)
            self._settle(packet.sequence)
            reply.put((packet, t_ns))
