"""The three stages of a calibration in a report: wide camera, mirrors with mount drift, rectification."""

from collections.abc import Mapping

import numpy as np

from foveacam_hardware.contract import Role
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.reports.markup import (
    drawing,
    facts,
    figures,
    not_measured,
    number,
    paragraph,
    section,
    table,
)
from foveacam_server.resources.calibrating.report.candidates import candidate_parts
from foveacam_server.resources.calibrating.report.drawings import field_drawing, sweep_drawing
from foveacam_server.resources.calibrating.sessions.schema import (
    ClosingDocument,
    LensDocument,
    MountDriftDocument,
    SessionDocument,
    SweepDocument,
    WideFitDocument,
)

_STATES = ("centred", "rim", "refused", "waiting")
_EYES = (Role.LEFT, Role.RIGHT)
DRIFT_NOT_MEASURED = (
    "No node was visited again during the sweeps: thermal drift of the mounts stays in, and the standard "
    "errors hold what is usual."
)


def wide_stage(
    calibration: Calibration, session: SessionDocument | None, pictures: Mapping[str, bytes]
) -> str:
    """Return stage 1: the wide camera."""
    lens = calibration.wide
    parts = [
        facts(
            [
                ("focal length, x and y", f"{lens.fx_px:.2f}, {lens.fy_px:.2f} px"),
                ("optical centre", f"{lens.cx_px:.2f}, {lens.cy_px:.2f} px"),
                ("image", f"{lens.width} × {lens.height} px"),
                ("distortion", ", ".join(f"{value:.4g}" for value in lens.distortion)),
            ]
        )
    ]
    wide = session.wide if session is not None else None
    if wide is None or wide.fit is None:
        parts.append(not_measured("views of a board", "foveacam calibrate wide"))
    else:
        parts.append(paragraph(_board_sentence(session)))
        coverage = "–" if wide.coverage_fraction is None else f"{100.0 * wide.coverage_fraction:.0f} %"
        parts.append(facts([("views", str(len(wide.samples))), ("image covered", coverage)]))
        fits = [fit for fit in (wide.fit, wide.other_model) if fit is not None]
        heads = ("lens model", "rms", "field of view", "focal length", "pixel to angle good to")
        parts.append(table(heads, [_lens_row(fit) for fit in fits]))
    captions = {
        "coverage": "Where the board was seen, and how it was tilted",
        "wide_residuals": "What the lens model leaves at every corner",
    }
    parts.append(figures(pictures, captions))
    parts += fovea_lenses(session, pictures)
    return section("wide", "Stage 1: the wide camera", *parts)


def fovea_lenses(session: SessionDocument | None, pictures: Mapping[str, bytes]) -> list[str]:
    """Return the lenses of the foveae, for information; nothing when none was looked for."""
    lenses = session.lenses if session is not None else ()
    if not lenses:
        return []
    heads = ("fovea", "views", "rms", "field of view", "parameters, with one standard error")
    captions = {
        "lens_left": "Left fovea: what its lens model leaves at every corner",
        "lens_right": "Right fovea: what its lens model leaves at every corner",
    }
    return [
        paragraph(
            "Lenses of the foveae, for information: the rectification depends on the mirrors and is fitted "
            "in stage 3, so that nothing of this enters the calibration."
        ),
        table(heads, [_fovea_row(lens) for lens in lenses]),
        figures(pictures, captions),
    ]


def _fovea_row(lens: LensDocument) -> tuple[str, ...]:
    views = str(len(lens.samples))
    if lens.fit is None:
        return (lens.camera, views, "–", "–", lens.reason)
    fit = lens.fit
    told = [f"{each.name} {each.value:.6g} ± {each.sigma:.2g}" for each in fit.parameters if not each.assumed]
    assumed = [each.name for each in fit.parameters if each.assumed]
    words = "; ".join([", ".join(told), *([f"assumed: {', '.join(assumed)}"] if assumed else [])])
    field = f"{fit.fov_x_deg:.3f}° × {fit.fov_y_deg:.3f}°"
    return (lens.camera, views, f"{fit.rms_px:.3f} px", field, words)


def mirror_stage(
    calibration: Calibration, session: SessionDocument | None, pictures: Mapping[str, bytes]
) -> str:
    """Return stage 2: from volts to angles."""
    rows = [_mirror_row(calibration, role) for role in _EYES]
    heads = (
        "eye",
        "order as kept",
        "left out, rms (ax, ay)",
        "standard error (ax, ay)",
        "volts up to (x, y)",
    )
    parts = [
        table(heads, rows),
        drawing(field_drawing(calibration), "Where each eye can look, beside the wide view"),
        *_sweeps(session),
        *candidate_parts(session, calibration),
        mount_drift(session),
    ]
    captions = {
        "mount_drift": "How the mounts drifted during the sweeps, against where they stood at the end",
        "quiver_left": "Left eye: what the model leaves at every pose",
        "quiver_right": "Right eye: what the model leaves at every pose",
        "loo": "Leave-one-out error by order",
    }
    parts.append(figures(pictures, captions))
    return section("mirrors", "Stage 2: from volts to angles", *parts)


def rectify_stage(calibration: Calibration, pictures: Mapping[str, bytes]) -> str:
    """Return stage 3: rectification to the virtual pinholes."""
    rows = [
        (
            role.value,
            str(calibration.eye(role).homography.polynomial.order),
            f"{calibration.eye(role).homography.loo_px:.3f} px",
        )
        for role in _EYES
    ]
    captions = {
        "warp_left": "Left eye: warp over the field",
        "warp_right": "Right eye: warp over the field",
        "anaglyph_before": "Both eyes before rectification",
        "anaglyph_after": "Both eyes after rectification",
    }
    parts = [
        paragraph(
            f"Each fovea image is brought to a virtual pinhole parallel to the wide camera, focal length "
            f"{calibration.fovea_f_px:.0f} px (Eq. 4)."
        ),
        table(("eye", "order", "left out, rms"), rows),
        figures(pictures, captions),
    ]
    if not any(name in pictures for name in captions):
        parts.append(not_measured("pictures of the warp and anaglyphs", "foveacam calibrate rectify"))
    return section("rectify", "Stage 3: rectification", *parts)


def _board_sentence(session: SessionDocument | None) -> str:
    board = session.board if session is not None else None
    if board is None:
        return ""
    marker = "" if board.marker_mm is None else f", markers of {board.marker_mm:g} mm"
    return (
        f"{board.kind} of {board.columns} × {board.rows} corners, squares of {board.square_mm:g} mm{marker}."
    )


def _lens_row(fit: WideFitDocument) -> tuple[str, ...]:
    return (
        fit.model,
        f"{fit.rms_px:.3f} px",
        f"{fit.fov_x_deg:.2f}° × {fit.fov_y_deg:.2f}°",
        f"{fit.fx_px:.1f}, {fit.fy_px:.1f} px",
        number(fit.accuracy_deg, 5, "°"),
    )


def _mirror_row(calibration: Calibration, role: Role) -> tuple[str, ...]:
    mirror = calibration.eye(role).mirror
    loo, sigma = np.rad2deg(mirror.loo_rad), np.rad2deg(mirror.sigma_rad)
    return (
        role.value,
        str(mirror.forward.order),
        f"{loo[0]:.4f}°, {loo[1]:.4f}°",
        f"{sigma[0]:.4f}°, {sigma[1]:.4f}°",
        f"{mirror.max_v[0]:.1f}, {mirror.max_v[1]:.1f} V",
    )


def _sweeps(session: SessionDocument | None) -> list[str]:
    if session is None or not session.sweeps:
        return [not_measured("a sweep of the mirrors", "foveacam calibrate mirrors")]
    heads = (
        "station",
        "distance",
        "poses",
        *(f"{eye}: {state}" for eye in ("L", "R") for state in _STATES[:3]),
    )
    parts = [table(heads, [_sweep_row(sweep) for sweep in session.sweeps], caption="Sweeps")]
    drawn = [
        drawing(
            sweep_drawing(sweep),
            f"Poses at {sweep.station}: left and right half of a dot are the left and right eye; green: "
            "centred, orange: at the volts' limit, red: refused, grey: not yet",
        )
        for sweep in session.sweeps
        if sweep.poses
    ]
    parts.append(f'<div class="figures">{"".join(drawn)}</div>' if drawn else "")
    return [*parts, _refusals(session)]


def _sweep_row(sweep: SweepDocument) -> tuple[str, ...]:
    states = [[getattr(pose, eye) for pose in sweep.poses] for eye in ("left", "right")]
    counts = [str(found.count(state)) for found in states for state in _STATES[:3]]
    return sweep.station, number(sweep.distance_m, 2, " m"), f"{sweep.done} of {sweep.nodes}", *counts


def _refusals(session: SessionDocument) -> str:
    rows = [
        (sweep.station, f"{pose.ax_deg:.2f}°, {pose.ay_deg:.2f}°", eye, reason)
        for sweep in session.sweeps
        for pose in sweep.poses
        for eye, reason in (("left", pose.left_reason), ("right", pose.right_reason))
        if reason
    ]
    return table(("station", "pose", "eye", "why refused"), rows, caption="Refused poses") if rows else ""


def mount_drift(session: SessionDocument | None) -> str:
    """Return a paragraph on the drift of the mounts during the sweeps and after them."""
    if session is None or session.fit is None:
        return ""
    if not session.fit.drift:
        return paragraph(DRIFT_NOT_MEASURED)
    return paragraph(f"{drift_sentence(session.fit.drift)}{closing_sentence(session.closing)}")


def drift_sentence(drift: dict[str, MountDriftDocument]) -> str:
    """Return a sentence on the speed and distance of each mount's drift."""
    eyes = "; ".join(
        f"{eye} eye {found.px_per_minute:.2f} fovea px a minute, {found.moved_px:.2f} ± "
        f"{found.sigma_px:.2f} px in all, over {found.minutes:.1f} min of measuring"
        for eye, found in drift.items()
    )
    return (
        "How the mounts moved during the sweeps and between them, seen at nodes visited again, taken out: "
        f"{eyes}.{knock_sentence(drift)}"
    )


def knock_sentence(drift: dict[str, MountDriftDocument]) -> str:
    """Return a sentence on the mounts that were knocked during a sweep, empty where there was none."""
    eyes = " and ".join(
        f"the {eye} eye's by {', then '.join(f'{size_px:.1f}' for size_px in found.knocks_px)} fovea px"
        for eye, found in drift.items()
        if found.knocks_px
    )
    return f" Mounts were knocked amid the sweeps, taken out too: {eyes}." if eyes else ""


def closing_sentence(closing: ClosingDocument | None) -> str:
    """Return a sentence on the drift between the sweeps and the check, empty where it is unknown."""
    if closing is None:
        return ""
    done = "taken out too" if closing.corrected else "within its own error, left in"
    return f" From then to the check the eyes' rows came {closing.rows_px:.2f} px apart: {done}."
