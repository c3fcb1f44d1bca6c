"""Charts of a report: scores of models as bars, drift over the checks."""

import math
from collections.abc import Sequence
from html import escape

from foveacam_pipeline.calibrate.report.drawings import svg
from foveacam_pipeline.calibrate.report.facts import DriftEyeFacts, DriftFacts, ModelFacts

_BAR_PITCH = 24
_NAMES_WIDTH = 250.0
_BARS_WIDTH = 330.0
_CHART_MIDDLE = 110.0
_CHART_REACH = 95.0
_CHART_WIDTH = 600.0
_MIN_REACH_DEG = 0.01


def score_bars(models: Sequence[ModelFacts]) -> str:
    """Return the leave-one-out error of every candidate, both axes together, on a logarithmic scale."""
    sizes = [math.hypot(*model.loo_deg) / math.sqrt(2.0) for model in models]
    logs = [math.log10(size) for size in sizes if size > 0.0] or [0.0]
    low, high = min(logs) - 0.3, max(logs)
    parts = []
    for row, (model, size) in enumerate(zip(models, sizes, strict=True)):
        share = (math.log10(size) - low) / (high - low) if size > 0.0 else 0.0
        parts.append(_score_bar(model, size, y=float(_BAR_PITCH * row), length=max(1.0, _BARS_WIDTH * share)))
    box = (0.0, 0.0, 680.0, _BAR_PITCH * len(models) + 4.0)
    return svg(parts, box, "leave-one-out error by model")


def drift_chart(checks: Sequence[DriftFacts]) -> str:
    """Return the shifts of both eyes over the checks, in their order, with their standard errors."""
    shifts = [
        abs(value) for check in checks for eye in check.eyes for value in (eye.shift_x_deg, eye.shift_y_deg)
    ]
    reach_deg = 1.2 * max([_MIN_REACH_DEG, *shifts])
    step = _CHART_WIDTH / max(1, len(checks))
    parts = [
        f'<line class="grid" x1="60" x2="680" y1="{_CHART_MIDDLE}" y2="{_CHART_MIDDLE}"/>',
        f'<text x="0" y="20">{reach_deg:+.3f}°</text>',
        f'<text x="0" y="{_CHART_MIDDLE + 4}">0</text>',
        f'<text x="0" y="208">{-reach_deg:+.3f}°</text>',
    ]
    for k, check in enumerate(checks):
        for eye in check.eyes:
            parts.append(
                _drift_marks(check, eye, x=70.0 + step * (k + 0.5), per_deg=_CHART_REACH / reach_deg)
            )
    return svg(parts, (0.0, 0.0, 690.0, 220.0), "drift over the checks")


def _score_bar(model: ModelFacts, size_deg: float, *, y: float, length: float) -> str:
    known = model.order is None or str(model.order) in model.name
    name = model.name if known else f"{model.name}, order {model.order}"
    words = escape(f"{model.eye}: {name}" + (" (chosen)" if model.chosen else ""))
    side = "left" if model.eye == "left" else "right"
    opacity = 1.0 if model.chosen else 0.4
    return (
        f'<text x="0" y="{y + 15}">{words}</text>'
        f'<rect class="{side}" stroke="none" fill-opacity="{opacity}" x="{_NAMES_WIDTH}" y="{y + 3}" '
        f'width="{length:.1f}" height="15" rx="2"/>'
        f'<text x="{_NAMES_WIDTH + 8 + length:.1f}" y="{y + 15}">{_rounded_deg(size_deg)}°</text>'
    )


def _rounded_deg(value: float) -> str:
    digits = 4 if value >= 1e-3 else 5
    return f"{value:.{digits}f}"


def _drift_marks(check: DriftFacts, eye: DriftEyeFacts, *, x: float, per_deg: float) -> str:
    side = "left" if eye.eye == "left" else "right"
    beside = -12.0 if side == "left" else 12.0
    error = per_deg * (eye.sigma_deg or 0.0)
    parts = []
    for offset, value, axis in ((-4.0, eye.shift_x_deg, "across"), (4.0, eye.shift_y_deg, "down")):
        at, y = x + beside + offset, _CHART_MIDDLE - per_deg * value
        words = f"<title>{escape(f'{check.created_utc}: {eye.eye} {axis} {value:+.4f}°')}</title>"
        parts.append(
            f'<line class="{side}" x1="{at:.1f}" x2="{at:.1f}" y1="{y - error:.1f}" y2="{y + error:.1f}"/>'
        )
        if axis == "across":
            parts.append(f'<circle class="{side}" cx="{at:.1f}" cy="{y:.1f}" r="4">{words}</circle>')
        else:
            corner = f'x="{at - 3.5:.1f}" y="{y - 3.5:.1f}"'
            parts.append(f'<rect class="{side}" {corner} width="7" height="7">{words}</rect>')
    return "".join(parts)
