"""Requests of rasters and recordings from a few values."""

from datetime import UTC, datetime

from foveacam_client.generated import models


def raster_request(
    *, columns: int, rows: int, name: str | None, distance_m: float | None
) -> models.CaptureRequest:
    """Return the request of a raster over the whole field; `distance_m`: None to measure it at the start."""
    plan = models.RasterPlan(points=models.GridPoints(columns=columns, rows=rows))
    if distance_m is not None:
        plan.verging = models.Verging(mode="given", distance_m=distance_m)
    return models.CaptureRequest(name=name or f"raster-{datetime.now(UTC):%Y%m%d-%H%M%S-%f}", plan=plan)


def recording_request(name: str | None, *, duration_s: float | None) -> models.RecordingRequest:
    """Return the request of a recording of all cameras; without a name, `recording` with a number."""
    return models.RecordingRequest(name=name or "recording", numbered=not name, duration_s=duration_s)
