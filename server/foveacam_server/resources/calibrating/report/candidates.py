"""The fit in a report: errors of all candidate models, comparison with the paper's model, parallax."""

from collections.abc import Mapping

from foveacam_hardware.contract import Role
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.reports.markup import (
    drawing,
    facts,
    named_figures,
    not_measured,
    paragraph,
    table,
)
from foveacam_server.resources.calibrating.report.drawings import score_bars
from foveacam_server.resources.calibrating.sessions.schema import FitDocument, SessionDocument

_EYES = ("left", "right")
_STEPS = ("pointing_rms_px", "rectification_rms_px", "epipolar_rms_px")


def candidate_parts(session: SessionDocument | None, calibration: Calibration) -> list[str]:
    """Return the HTML parts on the compared models, or a note that there were none."""
    fit = session.fit if session is not None else None
    if fit is None or not fit.models:
        return [
            not_measured(
                "candidates beside the chosen model", "foveacam calibrate mirrors fits and scores them"
            )
        ]
    return [
        drawing(score_bars(fit.models), "Leave-one-out error of every candidate, both axes, logarithmic"),
        *_paper_comparison(fit, calibration),
        *_parallax(fit.parallax or {}),
    ]


def _paper_comparison(fit: FitDocument, calibration: Calibration) -> list[str]:
    paper = fit.paper or {}
    if not paper:
        return []
    rows = [
        (
            f"gaze left out, {eye} eye (ax, ay)",
            _angles(_eye_value(paper.get("loo_deg"), eye)),
            _chosen_error(fit, eye),
        )
        for eye in _EYES
    ]
    rows += [
        (
            f"rectification left out, {role.value} eye",
            _with_unit(_eye_value(paper.get("rectify_loo_px"), role.value), "px"),
            f"{calibration.eye(role).homography.loo_px:.3f} px",
        )
        for role in (Role.LEFT, Role.RIGHT)
    ]
    if "volts_roundtrip_max_lsb" in paper:
        ours = _with_unit(fit.volts_roundtrip_max_lsb, "DAC steps")
        rows.append(
            (
                "volts to angle to volts, at most",
                _with_unit(paper["volts_roundtrip_max_lsb"], "DAC steps"),
                ours,
            )
        )
    return [
        "<h3>Beside the paper's plain model</h3>",
        table(("", "paper", "here"), rows),
        *_additions(paper.get("steps") or ()),
    ]


def _additions(steps: "tuple[Mapping[str, object], ...] | list[Mapping[str, object]]") -> list[str]:
    if not steps:
        return []
    rows = [(str(step["name"]), *(_with_unit(step[name], "px") for name in _STEPS)) for step in steps]
    return [
        paragraph(
            "What each addition brings: RMS at poses left out, in pixels of the fovea. “Ours, but …” takes "
            "one addition away."
        ),
        table(("model", "pointing", "rectification", "rows apart"), rows),
    ]


def _parallax(parallax: Mapping[str, object]) -> list[str]:
    if not parallax:
        return []
    stations = {name: found for name, found in parallax.items() if isinstance(found, Mapping)}
    heads = ("station", "distance by print", "by tape", "parallax, rms", "at most", "taken out")
    rows = [
        (
            name,
            _with_unit(found.get("print_m"), "m"),
            _with_unit(found.get("tape_m"), "m"),
            _with_unit(found.get("rms_deg"), "°"),
            _with_unit(found.get("largest_deg"), "°"),
            "yes" if found.get("corrected") else "no",
        )
        for name, found in stations.items()
    ]
    others = {name: found for name, found in parallax.items() if name not in stations}
    return [
        "<h3>Parallax of the markers (Eq. 1)</h3>",
        table(heads, rows) if rows else "",
        facts(named_figures(others)) if others else "",
    ]


def _eye_value(found: object, eye: str) -> object:
    return found.get(eye) if isinstance(found, Mapping) else None


def _chosen_error(fit: FitDocument, eye: str) -> str:
    chosen = next((model.loo_deg for model in fit.models if model.chosen and model.eye == eye), None)
    return _angles(chosen)


def _angles(pair: object) -> str:
    return ", ".join(f"{value:.4f}°" for value in pair) if isinstance(pair, list | tuple) else "–"


def _with_unit(value: object, unit: str) -> str:
    if not isinstance(value, int | float):
        return "–"
    digits = f"{value:.4g}" if unit == "m" else f"{value:.4f}" if unit == "°" else f"{value:.2f}"
    return digits + ("" if unit == "°" else " ") + unit
