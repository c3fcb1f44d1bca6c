"""The HTML page of a report: it loads nothing, and suits screens and paper, light and dark."""

import math
from collections.abc import Mapping, Sequence
from html import escape

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.reports.markup import moment, section, table
from foveacam_pipeline.reports.style import STYLE
from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument
from foveacam_server.resources.calibrating.report.stages import mirror_stage, rectify_stage, wide_stage
from foveacam_server.resources.calibrating.report.table2 import Specification, table2
from foveacam_server.resources.calibrating.report.verification import (
    check_part,
    depth_part,
    drift_part,
    settle_part,
)
from foveacam_server.resources.calibrating.sessions.schema import SessionDocument

PICTURES = (
    "coverage",
    "wide_residuals",
    "lens_left",
    "lens_right",
    "quiver_left",
    "quiver_right",
    "loo",
    "warp_left",
    "warp_right",
    "anaglyph_before",
    "anaglyph_after",
    "epipolar",
    "overlay",
    "settle",
    "drift",
)
"""Names of the pictures; any may be missing."""
_ANCHORS = {
    "table2": "Table 2",
    "wide": "Wide camera",
    "mirrors": "Mirrors",
    "rectify": "Rectification",
    "check": "Check",
    "settle": "Settling",
    "drift": "Drift",
    "depth": "Geometry",
}
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def report_html(
    calibration: Calibration,
    *,
    session: SessionDocument | None = None,
    pictures: Mapping[str, bytes] | None = None,
    drift: Sequence[DriftCheckDocument] = (),
) -> str:
    """Return the report of a calibration as one HTML page.

    `pictures`: PNG or JPEG by name (`PICTURES`). Parts that were not measured have a note how to measure
    them.
    """
    shown = pictures or {}
    title = f"Calibration {calibration.id}"
    parts = [
        _header(calibration, session, title),
        _table2(table2(calibration, session)),
        wide_stage(calibration, session, shown),
        mirror_stage(calibration, session, shown),
        rectify_stage(calibration, shown),
        check_part(session, shown),
        settle_part(session, shown),
        drift_part(drift, shown),
        depth_part(calibration),
        _footer(calibration, session),
    ]
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(parts)
        + "\n</main>\n</body>\n</html>\n"
    )


def _header(calibration: Calibration, session: SessionDocument | None, title: str) -> str:
    made = f"{calibration.origin} {moment(calibration.created_utc)}"
    about = f"{calibration.label} · rig {calibration.rig_id} · {made}"
    tiles = "".join(
        f'<div class="tile"><b>{escape(value)}</b><span>{escape(name)}</span></div>'
        for name, value in _tiles(calibration, session)
    )
    links = "".join(f'<a href="#{anchor}">{escape(name)}</a>' for anchor, name in _ANCHORS.items())
    return (
        f'<header><h1>{escape(title)}</h1><p class="under">{escape(about)}</p>'
        f'<div class="tiles">{tiles}</div><nav aria-label="Parts">{links}</nav></header>'
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


def _table2(rows: Sequence[Specification]) -> str:
    heads = ("specification", "", "paper", "measured here", "how")
    body = [
        (
            row.group if k == 0 or rows[k - 1].group != row.group else "",
            row.name,
            row.paper,
            row.measured or "not measured",
            row.note,
        )
        for k, row in enumerate(rows)
    ]
    return section(
        "table2",
        "Optics and actuation (Table 2 of the paper)",
        table(heads, body).replace('<div class="scroll">', '<div class="scroll table2">', 1),
    )


def _footer(calibration: Calibration, session: SessionDocument | None) -> str:
    lines = [f"Calibration {calibration.id}, the hash of its content."]
    if calibration.parent_id is not None:
        lines.append(f"Corrected from {calibration.parent_id}.")
    if session is not None:
        lines.append(f"Measured in session {session.id} ({session.label}), {moment(session.created_utc)}.")
        lines += [f"Could not be read: {problem}" for problem in session.problems]
    else:
        lines.append("The session that measured it is not kept here.")
    return "<footer>" + "".join(f"<p>{escape(line)}</p>" for line in lines) + "</footer>"
