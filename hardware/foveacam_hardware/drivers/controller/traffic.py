"""Traffic statistics of the controller's link: totals, rates of the last second, round-trip times.

Pure: times are passed in.
"""

from collections import deque
from collections.abc import Sequence

from foveacam_hardware.contract import LinkTelemetry, StereoVolts, StreamTelemetry
from foveacam_hardware.drivers.controller.volts import mirror_volts
from foveacam_hardware.wire.controller import TWO_PHASE, Packet, PacketProperty
from foveacam_hardware.wire.controller_payloads import StreamCommand, StreamOperation

BUCKET_NS = 100_000_000
BUCKETS = 10
ROUND_TRIPS = 1000
"""Number of round trips in the quantiles."""
RECENT_NS = 1_000_000_000
"""Age up to which round trips count as recent."""
_SLOW = frozenset({PacketProperty.ENABLE, PacketProperty.RESET})
"""Requests whose acknowledgement waits for the rail or the DACs."""

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


class RateMeter:
    """Rate per second, over the last second."""

    def __init__(self) -> None:
        self._buckets: deque[tuple[int, float]] = deque(maxlen=BUCKETS + 1)

    def add(self, t_ns: int, amount: float = 1.0) -> None:
        """Count `amount` at a time; times may go back by one bucket at most."""
        index = t_ns // BUCKET_NS
        if self._buckets and self._buckets[-1][0] >= index:
            last, sum_so_far = self._buckets[-1]
            self._buckets[-1] = last, sum_so_far + amount
        else:
            self._buckets.append((index, amount))

    def per_s(self, t_ns: int) -> float:
        """Return the rate over the ten complete tenths of a second before `t_ns`."""
        now = t_ns // BUCKET_NS
        return sum(amount for index, amount in self._buckets if now - BUCKETS <= index < now)


class TrafficCounters:
    """Counters of one session; callers hold the session's lock."""

    def __init__(self) -> None:
        self.tx_packets = self.tx_bytes = 0
        self.rx_packets = self.rx_bytes = self.bad_packets = self.crc_errors = 0
        self._rates = {name: RateMeter() for name in ("tx_bytes", "rx_bytes", "tx_packets", "rx_packets")}
        self._streams: dict[int, tuple[RateMeter, StreamCommand]] = {}
        self._round_trips_ms: deque[float] = deque(maxlen=ROUND_TRIPS)
        self._recent: deque[tuple[int, float]] = deque(maxlen=ROUND_TRIPS)

    def sent(self, packets: Sequence[Packet], *, size: int, t_ns: int) -> None:
        """Count packets sent in one write of `size` bytes."""
        self.tx_packets += len(packets)
        self.tx_bytes += size
        self._rates["tx_packets"].add(t_ns, len(packets))
        self._rates["tx_bytes"].add(t_ns, size)
        for packet in packets:
            if packet.prop is PacketProperty.STREAM:
                self._count_stream(StreamCommand.unpack(packet.payload), t_ns)

    def received(self, size: int, t_ns: int) -> None:
        """Count received bytes."""
        self.rx_bytes += size
        self._rates["rx_bytes"].add(t_ns, size)

    def received_packet(self, t_ns: int) -> None:
        """Count a valid packet."""
        self.rx_packets += 1
        self._rates["rx_packets"].add(t_ns)

    def acknowledged(self, prop: PacketProperty, *, sent_ns: int, t_ns: int) -> None:
        """Record a round trip."""
        if prop in _SLOW:
            return
        round_trip_ms = (t_ns - sent_ns) / 1e6
        self._round_trips_ms.append(round_trip_ms)
        if prop not in TWO_PHASE:
            self._recent.append((t_ns, round_trip_ms))

    def recent_p95_ms(self, t_ns: int) -> float | None:
        """Return the 95th percentile of recent round trips, ms; None without any in the last second."""
        while self._recent and self._recent[0][0] < t_ns - RECENT_NS:
            self._recent.popleft()
        return _quantile(sorted(ms for _, ms in self._recent), 0.95) if self._recent else None

    def fresh_p95_ms(self, t_ns: int, *, since_ns: int) -> float | None:
        """Return that percentile, or the longest round trip after `since_ns` if shorter; None without any.

        A late round trip is then seen once and not for a whole second.
        """
        p95_ms = self.recent_p95_ms(t_ns)
        fresh_ms = [ms for ended_ns, ms in self._recent if ended_ns > since_ns]
        return min(p95_ms, max(fresh_ms)) if p95_ms is not None and fresh_ms else None

    def telemetry(self, t_ns: int, *, queued_bytes: int, crc: bool) -> LinkTelemetry:
        """Return the traffic so far; the driver adds clock and update rate."""
        ordered = sorted(self._round_trips_ms)
        return LinkTelemetry(
            tx_packets=self.tx_packets,
            rx_packets=self.rx_packets,
            tx_bytes=self.tx_bytes,
            rx_bytes=self.rx_bytes,
            bad_packets=self.bad_packets,
            crc=crc,
            crc_errors=self.crc_errors,
            rtt_p50_ms=_quantile(ordered, 0.5),
            rtt_p95_ms=_quantile(ordered, 0.95),
            rtt_p99_ms=_quantile(ordered, 0.99),
            rtt_max_ms=ordered[-1] if ordered else 0.0,
            clock_offset_ns=0,
            tx_bytes_per_s=self._rates["tx_bytes"].per_s(t_ns),
            rx_bytes_per_s=self._rates["rx_bytes"].per_s(t_ns),
            tx_packets_per_s=self._rates["tx_packets"].per_s(t_ns),
            rx_packets_per_s=self._rates["rx_packets"].per_s(t_ns),
            queued_bytes=queued_bytes,
            streams=tuple(self._stream_telemetry(stream, t_ns) for stream in sorted(self._streams)),
        )

    def _count_stream(self, command: StreamCommand, t_ns: int) -> None:
        meter, _ = self._streams.get(command.stream, (RateMeter(), command))
        self._streams[command.stream] = meter, command
        if command.operation == StreamOperation.UPDATE:
            meter.add(t_ns)

    def _stream_telemetry(self, stream: int, t_ns: int) -> StreamTelemetry:
        meter, command = self._streams[stream]
        volts = StereoVolts(left=mirror_volts(command.left), right=mirror_volts(command.right))
        return StreamTelemetry(stream=stream, updates_per_s=meter.per_s(t_ns), volts=volts)


def _quantile(ordered: Sequence[float], fraction: float) -> float:
    return ordered[min(len(ordered) - 1, int(fraction * len(ordered)))] if ordered else 0.0
