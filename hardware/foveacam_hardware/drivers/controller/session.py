"""One open link to the controller: its reader thread, requests matched to replies, traffic counted.

Knows packets and deadlines; what the requests mean is `dialogue`'s and the driver's.
"""

import contextlib
import logging
import threading
from collections.abc import Sequence
from typing import TypeAlias

from foveacam_hardware.contract import Clock, LinkTelemetry, NotConnected
from foveacam_hardware.drivers.controller.replies import PendingReply, says_malformed
from foveacam_hardware.drivers.controller.traffic import TrafficCounters
from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    SILENT,
    BadCrc,
    BadPacket,
    Packet,
    PacketMethod,
    PacketProperty,
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
Message: TypeAlias = tuple[PacketMethod, PacketProperty, bytes]
"""A request before it has a sequence number."""

_LOG_LEVELS = {"[ERROR]": logging.ERROR, "[WARN]": logging.WARNING, "[VERBOSE]": logging.DEBUG}
_REPLIES = frozenset({PacketMethod.ACK, PacketMethod.REJ, PacketMethod.FIN})


class ControllerSession:
    """An open link with exactly one reader thread."""

    def __init__(self, link: PortLink, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._lock = threading.Lock()  # sequence, waiting replies, counters and the write itself
        self._waiting: dict[int, PendingReply] = {}
        self._unanswered: set[int] = set()
        self._answered = threading.Condition(self._lock)
        self._sequence = 0
        self._decoder = CobsDecoder()
        self._crc = False
        self._crc_after: int | None = None  # the request whose acknowledgement brings it into force
        self._traffic = TrafficCounters()
        self._strange = b""
        self._sent_ns = clock.now_ns()
        self._heartbeat_ns: int | None = None
        self.echoes = False
        """Whether what we say comes back: no controller does that."""
        self.failure: NotConnected | None = None
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="controller-reader", daemon=True)
        self._reader.start()

    def begin(self, *messages: Message) -> list[PendingReply]:
        """Send requests in one write; return their replies to be."""
        with self._lock:
            return self._begin(messages)

    def begin_crc(self, message: Message) -> PendingReply:
        """Send a request from whose acknowledgement on every packet, either way, carries a CRC."""
        with self._lock:
            (reply,) = self._begin([message])
            self._crc_after = reply.request.sequence
            return reply

    def speak_plainly(self) -> None:
        """Send and expect packets without a CRC from now on: whether the controller does, ask it."""
        with self._lock:
            self._crc, self._crc_after = False, None

    @property
    def crc(self) -> bool:
        """Whether packets carry a CRC now."""
        return self._crc

    def post(self, *messages: Message) -> None:
        """Send requests that the controller acts on without a reply."""
        with self._lock:
            self._write([Packet(method, prop, SILENT, payload) for method, prop, payload in messages])

    def forget(self, *replies: PendingReply) -> None:
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
        """Stop the reader and release the link, its packets plain again; harmless when closed."""
        self._end_crc()
        self._closing.set()
        if self._reader is not threading.current_thread():
            self._reader.join()
        self.fail(NotConnected("controller: the link was closed; connect again"))
        self._link.close()

    def telemetry(self) -> LinkTelemetry:
        """Return the traffic so far; clock and governor are the driver's to add."""
        queued_bytes = self._link.backlog().queued_bytes
        with self._lock:
            return self._traffic.telemetry(self._clock.now_ns(), queued_bytes=queued_bytes, crc=self._crc)

    def _end_crc(self) -> None:
        if self._crc and self.failure is None:
            self.speak_plainly()
            with contextlib.suppress(NotConnected):
                self.post((PacketMethod.NOP, PacketProperty.NONE, b""))

    def _begin(self, messages: Sequence[Message]) -> list[PendingReply]:
        replies = []
        for method, prop, payload in messages:
            self._sequence = next_sequence(self._sequence)
            packet = Packet(method, prop, self._sequence, payload)
            replies.append(PendingReply(packet, self._clock.now_ns(), quiet=lambda: self._link.quiet))
        self._waiting.update((reply.request.sequence, reply) for reply in replies)
        self._unanswered |= {reply.request.sequence for reply in replies}
        self._write([reply.request for reply in replies])
        return replies

    def _write(self, packets: Sequence[Packet]) -> None:
        if self.failure is not None:
            raise NotConnected(str(self.failure)) from self.failure
        data = b"".join(encode_packet(packet, crc=self._crc) for packet in packets)
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
            self.post((PacketMethod.NOP, PacketProperty.NONE, b""))

    def _take(self, data: bytes, t_ns: int) -> None:
        with self._lock:
            self._traffic.received(len(data), t_ns)
        if self._traffic.rx_packets == 0:
            self._strange = (self._strange + data)[:STRANGE_BYTES]
        for frame in self._decoder.feed(data):
            try:
                packet = decode_packet(frame, crc=self._crc)
            except BadPacket as bad:
                self._drop(frame, bad)
                continue
            if packet.method not in _REPLIES and packet.prop is not PacketProperty.LOG:
                self.echoes = True
                continue
            self._dispatch(packet, t_ns)

    def _drop(self, frame: bytes | None, bad: BadPacket) -> None:
        # Replies to malformed packets are noise with a wrong checksum (protocol page, fault 2).
        self._traffic.bad_packets += 1
        logger.debug("dropped a bad packet: %s", bad)
        if not isinstance(bad, BadCrc):
            return
        self._traffic.crc_errors += 1
        if says_malformed(frame):  # plainly, of a packet with a CRC: it knows of none
            found = "controller: it restarted, or another program used it (its CRC is off)"
            self.fail(NotConnected(f"{found}; connect again"))

    def _dispatch(self, packet: Packet, t_ns: int) -> None:
        with self._lock:
            self._traffic.taken(t_ns)
        self._strange = b""
        if packet.prop is PacketProperty.LOG:
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
            if packet.method is PacketMethod.ACK:
                self._traffic.acknowledged(packet.prop, sent_ns=reply.sent_ns, t_ns=t_ns)
            if packet.sequence == self._crc_after:
                self._crc, self._crc_after = packet.method is PacketMethod.ACK, None
            self._settle(packet.sequence)
            reply.put((packet, t_ns))
