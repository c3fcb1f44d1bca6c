"""What went over the controller's link, counted in virtual time; and the drift of its clock."""

import pytest

from foveacam_hardware.drivers.controller.clock import ClockMap
from foveacam_hardware.drivers.controller.traffic import RateMeter, TrafficCounters
from foveacam_hardware.wire.controller import Packet, PacketMethod, PacketProperty
from foveacam_hardware.wire.controller_payloads import StreamCommand, StreamOperation

MS_NS = 1_000_000
SECOND_NS = 1_000_000_000


def update(stream: int, x_plus: int = 29_490) -> Packet:
    command = StreamCommand(
        operation=StreamOperation.UPDATE,
        stream=stream,
        left=(x_plus, 29_490, 29_490, 29_490),
        right=(29_490,) * 4,
    )
    return Packet(PacketMethod.SET, PacketProperty.STREAM, 0, command.pack())


def test_a_rate_is_that_of_the_last_second_and_falls_to_nothing() -> None:
    meter = RateMeter()
    for millisecond in range(0, 2000, 2):
        meter.add(millisecond * MS_NS)

    assert meter.per_s(2 * SECOND_NS) == 500.0
    assert meter.per_s(2 * SECOND_NS + SECOND_NS // 2) == 250.0
    assert meter.per_s(4 * SECOND_NS) == 0.0


def test_bytes_packets_and_updates_of_each_stream_are_counted() -> None:
    traffic = TrafficCounters()
    for millisecond in range(0, 1000, 10):
        traffic.sent([update(0)], size=24, t_ns=millisecond * MS_NS)
        traffic.sent([update(1), update(1, 32_767)], size=48, t_ns=millisecond * MS_NS)
        traffic.received(9, millisecond * MS_NS)
        traffic.received_packet(millisecond * MS_NS)

    found = traffic.telemetry(SECOND_NS, queued_bytes=7, crc=True)

    assert (found.tx_packets, found.tx_bytes, found.rx_packets, found.rx_bytes) == (300, 7200, 100, 900)
    assert (found.tx_packets_per_s, found.tx_bytes_per_s) == (300.0, 7200.0)
    assert (found.rx_packets_per_s, found.rx_bytes_per_s, found.queued_bytes) == (100.0, 900.0, 7)
    assert [(stream.stream, stream.updates_per_s) for stream in found.streams] == [(0, 100.0), (1, 200.0)]
    assert found.streams[1].volts.left.x_v == pytest.approx(10.0, abs=0.01)


def test_round_trips_have_quantiles_and_a_worst() -> None:
    traffic = TrafficCounters()
    for number in range(100):
        traffic.acknowledged(PacketProperty.TIMESTAMP, sent_ns=0, t_ns=(number + 1) * MS_NS)

    found = traffic.telemetry(SECOND_NS, queued_bytes=0, crc=False)

    assert (found.rtt_p50_ms, found.rtt_p95_ms, found.rtt_p99_ms, found.rtt_max_ms) == (51, 96, 100, 100)


def test_switching_the_rail_and_exposures_do_not_make_the_link_slow() -> None:
    traffic = TrafficCounters()
    traffic.acknowledged(PacketProperty.TIMESTAMP, sent_ns=0, t_ns=MS_NS)
    for prop in (PacketProperty.ENABLE, PacketProperty.RESET, PacketProperty.FRAME):
        traffic.acknowledged(prop, sent_ns=0, t_ns=50 * MS_NS)

    assert traffic.recent_p95_ms(100 * MS_NS) == 1.0
    assert traffic.recent_p95_ms(2 * SECOND_NS) is None


def test_a_late_round_trip_is_fresh_once() -> None:
    traffic = TrafficCounters()
    traffic.acknowledged(PacketProperty.TIMESTAMP, sent_ns=0, t_ns=40 * MS_NS)
    traffic.acknowledged(PacketProperty.TIMESTAMP, sent_ns=150 * MS_NS, t_ns=151 * MS_NS)

    assert traffic.recent_p95_ms(200 * MS_NS) == 40.0
    assert traffic.fresh_p95_ms(100 * MS_NS, since_ns=0) == 40.0
    assert traffic.fresh_p95_ms(200 * MS_NS, since_ns=100 * MS_NS) == 1.0
    assert traffic.fresh_p95_ms(300 * MS_NS, since_ns=200 * MS_NS) is None


@pytest.mark.parametrize("ppm", [-60.0, 0.0, 35.0])
def test_the_drift_is_told_through_the_jitter_of_the_pings(ppm: float) -> None:
    clock_map = ClockMap()
    assert clock_map.drift_ppm is None
    for number in range(60):
        sent_ns = 10 * SECOND_NS + number * SECOND_NS // 2
        out_us, back_us = 40 + (number * 37) % 90, 40 + (number * 53) % 90
        controller_us = round((sent_ns / 1000 + out_us) * (1 + ppm * 1e-6))
        clock_map.add(
            sent_ns=sent_ns, received_ns=sent_ns + (out_us + back_us) * 1000, controller_us=controller_us
        )

    # 60 pings over 30 s with up to 45 us of asymmetry each: under 1 ppm by least squares.
    assert clock_map.drift_ppm == pytest.approx(ppm, abs=1.0)


def test_pings_over_a_moment_tell_no_drift() -> None:
    clock_map = ClockMap()
    for number in range(10):
        clock_map.add(sent_ns=number * MS_NS, received_ns=number * MS_NS, controller_us=number * 1000)

    assert clock_map.drift_ppm is None
