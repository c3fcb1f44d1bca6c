"""Fixations as the server stores them."""

from datetime import UTC, datetime, timedelta

from foveacam_server.resources.looking.fixations.schema import FixationDocument, TargetPlace


def fixation(name: str, *, target_id: str | None = None, age_days: float = 99.0) -> FixationDocument:
    """Return a verged fixation of a point 2 m away."""
    return FixationDocument(
        id=f"fix-{name}",
        job_id="job-1",
        created_utc=(datetime.now(UTC) - timedelta(days=age_days)).isoformat(),
        request={"direction": {"ax_deg": 1.0, "ay_deg": 0.0}},
        target=TargetPlace(ax_deg=1.0, ay_deg=0.0, x_px=700.0, y_px=500.0),
        state="verged",
        reason="",
        distance_m=2.0,
        distance_sigma_m=0.01,
        point_rig_m=(0.0, 0.0, 2.0),
        residual_px=0.1,
        score=0.9,
        duration_ms=100.0,
        steps=[],
        calibration_id="cal",
        target_id=target_id,
        cloud_id=None,
    )
