"""The HTML page of a report: loads no other file; for screens and paper, light and dark."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from foveacam_pipeline.geometry.triangulate import depth_sigma_m
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.reports.page import fill_template
from foveacam_server.resources.calibrating.acceptances.schema import AcceptanceDocument
from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument
from foveacam_server.resources.calibrating.report.table2 import table2
from foveacam_server.resources.calibrating.sessions.schema import (
    ModelScoreDocument,
    SessionDocument,
    SettleAxisDocument,
)

_DISTANCES_M = (2.0, 5.0, 10.0, 15.0, 20.0)
_BARS_WIDTH = 330.0
"""Length of the longest bar of the compared models, in units of the drawing."""


def report_html(
    calibration: Calibration,
    *,
    session: SessionDocument | None = None,
    pictures: Mapping[str, bytes] | None = None,
    drift: Sequence[DriftCheckDocument] = (),
    acceptances: Sequence[AcceptanceDocument] = (),
) -> str:
    """Return the report of a calibration as one HTML page.

    `pictures`: PNG or JPEG by name, as a session stores them; any may be missing. Parts without measurements
    have a note on how to measure them.
    """
    fit = session.fit if session is not None else None
    return fill_template(
        Path(__file__).with_name("report.html.j2"),
        calibration=calibration,
        session=session,
        pictures=pictures or {},
        drift=sorted(drift, key=lambda check: check.created_utc),
        acceptances=acceptances,
        tiles=_tiles(calibration, session),
        table2=table2_rows(calibration, _settled_axes(session)),
        field=_field_deg(calibration),
        bars=[] if fit is None else list(_bars(fit.models)),
        depth_rows=[_depth_row(calibration, distance_m) for distance_m in _DISTANCES_M],
    )


def _tiles(calibration: Calibration, session: SessionDocument | None) -> list[tuple[str, str]]:
    eyes = (calibration.left, calibration.right)
    worst_rad = max(max(eye.mirror.loo_rad) for eye in eyes)
    tiles = [
        ("baseline", f"{1e3 * calibration.baseline_m:.2f} mm"),
        ("gaze, left out, worst axis", f"{math.degrees(worst_rad):.4f}°"),
        ("rectification, left out", f"{max(eye.homography.loo_px for eye in eyes):.2f} px"),
    ]
    if session is not None and session.wide is not None and session.wide.fit is not None:
        tiles.insert(0, ("wide camera, rms", f"{session.wide.fit.rms_px:.3f} px"))
    check = session.check if session is not None else None
    if check is not None and check.epipolar_rms_px is not None:
        tiles.append(("row mismatch at new poses, rms", f"{check.epipolar_rms_px:.2f} px"))
    if check is not None and check.pointing_rms_px is not None:
        tiles.append(("pointing at new poses, rms", f"{check.pointing_rms_px:.2f} px"))
    return tiles


def _settled_axes(session: SessionDocument | None) -> Sequence[SettleAxisDocument]:
    return session.settle.axes if session is not None and session.settle is not None else ()


def table2_rows(calibration: Calibration, axes: Sequence[SettleAxisDocument]) -> list[tuple[str, ...]]:
    """Return the rows of Table 2 as text, each group named once; `axes`: as of `table2`."""
    rows = table2(calibration, axes)
    above = ["", *(row.group for row in rows)]
    return [
        (
            "" if row.group == group else row.group,
            row.name,
            row.paper,
            row.measured or "not measured",
            row.note,
        )
        for row, group in zip(rows, above, strict=False)
    ]


def _field_deg(calibration: Calibration) -> dict[str, list[float] | list[list[float]]]:
    """Return left, right, top, bottom of the wide view and of both eyes' common reach; each eye's hull."""
    return {
        "wide": np.rad2deg(calibration.wide.field_rad).tolist(),
        "both": np.rad2deg(calibration.reach_rad()).tolist(),
        "left": np.rad2deg(calibration.left.mirror.hull_rad).tolist(),
        "right": np.rad2deg(calibration.right.mirror.hull_rad).tolist(),
    }


def _bars(models: Sequence[ModelScoreDocument]) -> Iterator[tuple[ModelScoreDocument, float, float]]:
    """Yield each model, its error of both axes together, deg, and the length of its bar, logarithmic."""
    errors_deg = [math.hypot(*model.loo_deg) / math.sqrt(2.0) for model in models]
    logs = [math.log10(error) for error in errors_deg if error > 0.0] or [0.0]
    low, high = min(logs) - 0.3, max(logs)
    for model, error in zip(models, errors_deg, strict=True):
        share = (math.log10(error) - low) / (high - low) if error > 0.0 else 0.0
        yield model, error, max(1.0, _BARS_WIDTH * share)


def _depth_row(calibration: Calibration, distance_m: float) -> tuple[str, ...]:
    sigma_px = calibration.pose_sigma_px(distance_m)
    f_px, baseline_m = calibration.fovea_f_px, calibration.baseline_m
    sigma_m = float(depth_sigma_m(distance_m, sigma_px, f_px=f_px, baseline_m=baseline_m))
    return (
        f"{distance_m:g} m",
        f"{sigma_px:.2f} px",
        f"{1e3 * sigma_m:.1f} mm",
        f"{100.0 * sigma_m / distance_m:.3f} %",
        f"{calibration.epipolar_sigma_px(distance_m):.2f} px",
    )
