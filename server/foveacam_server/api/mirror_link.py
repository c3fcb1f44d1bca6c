"""The controller's link as REST shows it."""

from foveacam_hardware.contract import DeviceInfo, LinkTelemetry, StreamTelemetry
from foveacam_server.api.rig_models import ControllerDocument, ControllerLinkDocument, PositionStreamDocument


def controller_document(info: DeviceInfo | None) -> ControllerDocument | None:
    """Return who the controller is; None before the rig is open."""
    if info is None:
        return None
    return ControllerDocument(
        vendor=info.vendor, model=info.model, serial=info.serial, version=info.version, port=info.port
    )


def link_document(telemetry: LinkTelemetry) -> ControllerLinkDocument:
    """Return traffic, round trips, governor and clock."""
    drift_ppm = telemetry.clock_drift_ppm
    return ControllerLinkDocument(
        tx_bytes=telemetry.tx_bytes,
        rx_bytes=telemetry.rx_bytes,
        tx_packets=telemetry.tx_packets,
        rx_packets=telemetry.rx_packets,
        bad_packets=telemetry.bad_packets,
        crc=telemetry.crc,
        crc_errors=telemetry.crc_errors,
        lost_answers=telemetry.lost_answers,
        tx_bytes_per_s=telemetry.tx_bytes_per_s,
        rx_bytes_per_s=telemetry.rx_bytes_per_s,
        tx_packets_per_s=telemetry.tx_packets_per_s,
        rx_packets_per_s=telemetry.rx_packets_per_s,
        queued_bytes=telemetry.queued_bytes,
        rtt_p50_ms=round(telemetry.rtt_p50_ms, 3),
        rtt_p95_ms=round(telemetry.rtt_p95_ms, 3),
        rtt_p99_ms=round(telemetry.rtt_p99_ms, 3),
        rtt_max_ms=round(telemetry.rtt_max_ms, 3),
        update_limit_hz=telemetry.update_limit_hz,
        clock_offset_ms=round(telemetry.clock_offset_ns / 1e6, 3),
        clock_drift_ppm=None if drift_ppm is None else round(drift_ppm, 2),
        streams=[_stream(stream) for stream in telemetry.streams],
    )


def _stream(stream: StreamTelemetry) -> PositionStreamDocument:
    volts = stream.volts
    return PositionStreamDocument(
        stream=stream.stream,
        updates_per_s=stream.updates_per_s,
        left_x_v=round(volts.left.x_v, 4),
        left_y_v=round(volts.left.y_v, 4),
        right_x_v=round(volts.right.x_v, 4),
        right_y_v=round(volts.right.y_v, 4),
    )
