"""Verification parts of a report: the check, settling, drift since, and the resulting depth errors."""

from collections.abc import Mapping, Sequence

from foveacam_pipeline.geometry.triangulate import depth_sigma_m
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.reports.markup import (
    drawing,
    facts,
    figure,
    figures,
    moment,
    not_measured,
    number,
    paragraph,
    section,
    signed_deg,
    table,
)
from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument
from foveacam_server.resources.calibrating.report.drawings import drift_chart
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument, SettleAxisDocument

_DISTANCES_M = (2.0, 5.0, 10.0, 15.0, 20.0)


def check_part(session: SessionDocument | None, pictures: Mapping[str, bytes]) -> str:
    """Return the errors at poses outside the sweeps."""
    check = session.check if session is not None else None
    captions = {
        "epipolar": "Vertical epipolar error over the field",
        "overlay": "The foveae laid over the wide view",
    }
    if check is None:
        found = not_measured("the calibration at poses outside the sweep", "foveacam calibrate check")
    else:
        found = facts(
            [
                ("poses", str(check.poses)),
                ("row mismatch, rms", number(check.epipolar_rms_px, 3, " px")),
                ("row mismatch, 95 %", number(check.epipolar_p95_px, 3, " px")),
                ("pointing, rms", number(check.pointing_rms_px, 2, " px")),
            ]
        )
    return section("check", "Check at poses outside the sweep", found, figures(pictures, captions))


def settle_part(session: SessionDocument | None, pictures: Mapping[str, bytes]) -> str:
    """Return the settling of each axis."""
    axes = session.settle.axes if session is not None and session.settle is not None else ()
    if not axes:
        found = not_measured("how the mirrors settle", "foveacam calibrate settle")
    else:
        heads = ("eye", "axis", "to one fovea pixel", "to 1 % of the step", "resonance", "Q")
        found = table(heads, [_axis_row(axis) for axis in axes])
    captions = {"settle": "Image shift against the final frame, over the delay after a step"}
    return section("settle", "How the mirrors settle", found, figures(pictures, captions))


def drift_part(checks: Sequence[DriftCheckDocument], pictures: Mapping[str, bytes]) -> str:
    """Return the drift checks, oldest first."""
    if not checks:
        return section(
            "drift",
            "Drift in the field",
            not_measured("drift since the calibration", "foveacam calibrate drift"),
        )
    ordered = sorted(checks, key=lambda check: check.created_utc)
    heads = ("when", "eye", "shift across", "shift down", "rotation", "standard error", "outcome")
    rows = [
        (
            moment(check.created_utc),
            eye.eye,
            signed_deg(eye.shift_x_deg),
            signed_deg(eye.shift_y_deg),
            signed_deg(eye.rotation_deg),
            number(eye.sigma_deg, 4, "°"),
            "applied" if check.applied else "significant" if eye.significant else "within its error",
        )
        for check in ordered
        for eye in check.eyes
    ]
    trend = (
        figure(pictures["drift"], "Trend of the drift")
        if "drift" in pictures
        else drawing(
            drift_chart(ordered),
            "Shift of both eyes at each check, oldest first: circles across, squares down; "
            "blue left eye, orange right eye",
        )
    )
    return section("drift", "Drift in the field", trend, table(heads, rows))


def depth_part(calibration: Calibration) -> str:
    """Return the geometry, and the errors of depth by the calibration alone."""
    rows = []
    for distance_m in _DISTANCES_M:
        sigma_px = calibration.pose_sigma_px(distance_m)
        f_px, baseline_m = calibration.fovea_f_px, calibration.baseline_m
        sigma_m = float(depth_sigma_m(distance_m, sigma_px, f_px=f_px, baseline_m=baseline_m))
        rows.append(
            (
                f"{distance_m:g} m",
                f"{sigma_px:.2f} px",
                f"{1e3 * sigma_m:.1f} mm",
                f"{100.0 * sigma_m / distance_m:.3f} %",
                f"{calibration.epipolar_sigma_px(distance_m):.2f} px",
            )
        )
    heads = ("distance", "disparity", "depth", "relative", "rows")
    pivots = [
        (
            f"{name} pivot off its drawing (x, y, z)",
            ", ".join(f"{1e3 * c:+.2f}" for c in eye.pivot_offset_m) + " mm",
        )
        for name, eye in (("left", calibration.left), ("right", calibration.right))
    ]
    return section(
        "depth",
        "Geometry, and what depth it gives",
        facts(
            [
                ("baseline", f"{1e3 * calibration.baseline_m:.2f} mm"),
                ("pupil behind the pivots", f"{1e3 * calibration.pupil_m:.1f} mm"),
                *pivots,
            ]
        ),
        paragraph("Standard errors of the calibration alone; matching adds its own."),
        table(heads, rows),
    )


def _axis_row(axis: SettleAxisDocument) -> tuple[str, ...]:
    return (
        axis.eye,
        axis.axis,
        number(axis.settle_ms, 2, " ms"),
        number(axis.settle_1pct_ms, 2, " ms"),
        number(axis.resonance_hz, 0, " Hz"),
        number(axis.quality, 1),
    )
