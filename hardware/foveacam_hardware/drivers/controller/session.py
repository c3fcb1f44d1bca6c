"""One open link to the controller: the reader thread, matching of replies to requests, traffic counters.

Knows packets and sequence numbers; the meaning of requests is left to `requests` and the driver.
"""

import contextlib
import logging
import threading
from collections.abc import Sequence
from typing import TypeAlias

from foveacam_hardware.contract import Clock, LinkTelemetry, NotConnected
from foveacam_hardware.drivers.controller.replies import PendingReply, is_malformed_refusal
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
"""Longest delay of the reader in noticing `close`."""
UNRECOGNISED_BYTES = 64
"""Number of bytes stored of a port's output that is not a packet."""
Message: TypeAlias = tuple[PacketMethod, PacketProperty, bytes]
"""A request before it has a sequence number."""

_LOG_LEVELS = {"[ERROR]": logging.ERROR, "[WARN]": logging.WARNING, "[VERBOSE]": logging.DEBUG}
_REPLIES = frozenset({PacketMethod.ACK, PacketMethod.REJ, PacketMethod.FIN})


class ControllerSession:
    """An open link with exactly one reader thread."""

    def __init__(self, link: PortLink, clock: Clock) -> None:
        self._link = link
        self._clock = clock
        self._lock = threading.Lock()  # protects sequence, waiting replies, counters and the write itself
        self._waiting: dict[int, PendingReply] = {}
        self._unanswered: set[int] = set()
        self._answered = threading.Condition(self._lock)
        self._sequence = 0
        self._decoder = CobsDecoder()
        self._crc = False
        self._crc_after: int | None = None  # the request whose acknowledgement puts the CRC in force
        self._traffic = TrafficCounters()
        self._unrecognised = b""
        self._sent_ns = clock.now_ns()
        self._keep_alive_ns: int | None = None
        self.is_echoed = False
        """Whether the port echoes our packets, which no controller does."""
        self.failure: NotConnected | None = None
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="controller-reader", daemon=True)
        self._reader.start()

    def begin(self, *messages: Message) -> list[PendingReply]:
        """Send requests in one write; return their pending replies."""
        with self._lock:
            return self._begin(messages)

    def begin_crc(self, message: Message) -> PendingReply:
        """Send the request whose acknowledgement puts the CRC in force for both directions."""
        with self._lock:
            (reply,) = self._begin([message])
            self._crc_after = reply.request.sequence
            return reply

    def disable_crc(self) -> None:
        """Send and expect packets without a CRC from now on; the controller's mode is not changed."""
        with self._lock:
            self._crc, self._crc_after = False, None

    def post(self, *messages: Message) -> None:
        """Send requests that the controller executes without a reply."""
        with self._lock:
            self._write([Packet(method, prop, SILENT, payload) for method, prop, payload in messages])

    def forget(self, *replies: PendingReply) -> None:
        """Stop expecting replies; late ones are dropped."""
        with self._lock:
            for reply in replies:
                self._waiting.pop(reply.request.sequence, None)
                self._mark_answered(reply.request.sequence)

    @property
    def pending(self) -> bool:
        """Whether a request waits for its first reply."""
        return bool(self._unanswered)

    def wait_answered(self, timeout_s: float) -> None:
        """Wait until no request waits for its first reply, or the time is over."""
        with self._answered:
            self._answered.wait_for(lambda: not self._unanswered, timeout_s)

    def keep_alive(self, period_ns: int) -> None:
        """Send a packet at least this often from now on, for a controller with a watchdog."""
        self._keep_alive_ns = period_ns

    @property
    def unrecognised(self) -> bytes:
        """The first bytes received, while no packet has been among them."""
        return self._unrecognised

    @property
    def identity(self) -> PortIdentity:
        """The port and the USB device behind it."""
        return self._link.identity

    @property
    def file(self) -> int | None:
        """File descriptor of the open port, to hand over."""
        return self._link.file

    def backlog(self) -> Backlog:
        """Return the waiting output."""
        return self._link.backlog()

    def recent_p95_ms(self) -> float | None:
        """Return the 95th percentile of recent round trips, ms; None without any in the last second."""
        with self._lock:
            return self._traffic.recent_p95_ms(self._clock.now_ns())

    def fresh_p95_ms(self, *, since_ns: int) -> float | None:
        """Return that percentile, or the longest round trip after `since_ns` if shorter; None without any."""
        with self._lock:
            return self._traffic.fresh_p95_ms(self._clock.now_ns(), since_ns=since_ns)

    def fail(self, failure: NotConnected) -> None:
        """Declare the link lost; every waiting request fails at once."""
        with self._lock:
            self._fail(failure)

    def close(self) -> None:
        """End the CRC, stop the reader and release the link; do nothing when closed."""
        self._end_crc()
        self._closing.set()
        if self._reader is not threading.current_thread():
            self._reader.join()
        self.fail(NotConnected("controller: the link was closed; connect again"))
        self._link.close()

    def telemetry(self) -> LinkTelemetry:
        """Return the traffic so far; the driver adds clock and update rate."""
        queued_bytes = self._link.backlog().queued_bytes
        with self._lock:
            return self._traffic.telemetry(self._clock.now_ns(), queued_bytes=queued_bytes, crc=self._crc)

    def _end_crc(self) -> None:
        if self._crc and self.failure is None:
            self.disable_crc()
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

    def _mark_answered(self, sequence: int) -> None:
        self._unanswered.discard(sequence)
        if not self._unanswered:
            self._answered.notify_all()

    def _read(self) -> None:
        try:
            while not self._closing.is_set() and self.failure is None:
                data = self._link.read(POLL_S)
                if data:
                    self._process(data, self._clock.now_ns())
                self._send_keep_alive()
        except NotConnected as lost:
            self.fail(lost)
        except Exception as bug:  # outermost frame of the thread: no caller may wait for a dead reader
            logger.exception("the controller's reader thread stopped")
            self.fail(NotConnected(f"controller: the reader stopped ({bug}); connect again"))

    def _send_keep_alive(self) -> None:
        if self._keep_alive_ns is None or self._clock.now_ns() - self._sent_ns < self._keep_alive_ns:
            return
        with contextlib.suppress(NotConnected):  # the next read reports it
            self.post((PacketMethod.NOP, PacketProperty.NONE, b""))

    def _process(self, data: bytes, t_ns: int) -> None:
        with self._lock:
            self._traffic.received(len(data), t_ns)
        if self._traffic.rx_packets == 0:
            self._unrecognised = (self._unrecognised + data)[:UNRECOGNISED_BYTES]
        for frame in self._decoder.feed(data):
            try:
                packet = decode_packet(frame, crc=self._crc)
            except BadPacket as bad:
                self._drop(frame, bad)
                continue
            if packet.method not in _REPLIES and packet.prop is not PacketProperty.LOG:
                self.is_echoed = True
                continue
            self._dispatch(packet, t_ns)

    def _drop(self, frame: bytes | None, bad: BadPacket) -> None:
        # Replies to malformed packets are noise with a wrong checksum (protocol page, fault 2).
        self._traffic.bad_packets += 1
        logger.debug("dropped a bad packet: %s", bad)
        if not isinstance(bad, BadCrc):
            return
        self._traffic.crc_errors += 1
        if is_malformed_refusal(frame):  # a plain refusal of a packet with a CRC: the CRC is off there
            found = "controller: it restarted, or another program used it (its CRC is off)"
            self.fail(NotConnected(f"{found}; connect again"))

    def _dispatch(self, packet: Packet, t_ns: int) -> None:
        with self._lock:
            self._traffic.received_packet(t_ns)
        self._unrecognised = b""
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
                logger.debug("no request waits for %s", packet)
                return
            if packet.method is PacketMethod.ACK:
                self._traffic.acknowledged(packet.prop, sent_ns=reply.sent_ns, t_ns=t_ns)
            if packet.sequence == self._crc_after:
                self._crc, self._crc_after = packet.method is PacketMethod.ACK, None
            self._mark_answered(packet.sequence)
            reply.put((packet, t_ns))
