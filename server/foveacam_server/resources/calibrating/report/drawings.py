"""SVG drawings of a report: fields of view, poses of a sweep, errors of models, drift over the checks."""

import math
from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.resources.calibrating.drift_checks.schema import DriftCheckDocument, DriftEyeDocument
from foveacam_server.resources.calibrating.sessions.schema import (
    ModelScoreDocument,
    SweepDocument,
    SweepPoseDocument,
)

_PAPER_HALF_DEG = 10.0  # Table 2: actuation range 20° x 20°
_STATES = ("centred", "rim", "refused", "waiting")
_DOT_DEG = 0.32
_BAR_PITCH = 24
_NAMES_WIDTH = 250.0
_BARS_WIDTH = 330.0
_CHART_MIDDLE = 110.0
_CHART_REACH = 95.0
_CHART_WIDTH = 600.0
_MIN_REACH_DEG = 0.01


def field_drawing(calibration: Calibration) -> str:
    """Return the fields of both eyes, their common box, the wide view and the paper's range, in degrees."""
    wide = np.rad2deg(calibration.wide.field_rad)
    common = np.rad2deg(calibration.reach_rad())
    half = 1.06 * float(max(np.abs(wide).max(), _PAPER_HALF_DEG))
    tall = 1.06 * float(max(np.abs(wide[2:]).max(), _PAPER_HALF_DEG))
    paper = (-_PAPER_HALF_DEG, _PAPER_HALF_DEG, -_PAPER_HALF_DEG, _PAPER_HALF_DEG)
    parts = [
        _grid(half, tall),
        _box(wide, "frame"),
        _box(paper, "frame dashed"),
        _outline(np.rad2deg(calibration.left.mirror.hull_rad), "left area"),
        _outline(np.rad2deg(calibration.right.mirror.hull_rad), "right area"),
        _box(common, "frame"),
        _label(wide[0] + 0.3, wide[2] + 0.8, "wide view"),
        _label(-_PAPER_HALF_DEG + 0.3, -_PAPER_HALF_DEG - 0.2, "20° × 20° (paper)"),
        _label(common[0] + 0.3, common[3] - 0.3, "both eyes reach"),
    ]
    box = (-half, -tall, 2.0 * half, 2.0 * tall)
    return svg(parts, box, "fields of view in degrees", text_deg=0.55)


def sweep_drawing(sweep: SweepDocument) -> str:
    """Return the poses of a sweep: the halves of a dot are the left and the right eye."""
    at = np.array([(pose.ax_deg, pose.ay_deg) for pose in sweep.poses])
    half, tall = (1.15 * np.abs(at).max(axis=0) + 0.5).tolist()
    dots = [
        _half_dot(pose, state, reason, bend=bend)
        for pose in sweep.poses
        for state, reason, bend in ((pose.left, pose.left_reason, 0), (pose.right, pose.right_reason, 1))
    ]
    box = (-half, -tall, 2.0 * half, 2.0 * tall)
    return svg([_grid(half, tall), *dots], box, f"poses at {sweep.station}", text_deg=0.5)


def svg(parts: Sequence[str], box: tuple[float, ...], label: str, *, text_deg: float | None = None) -> str:
    """Return an SVG over `box` (x, y, width, height); `text_deg`: text size of a drawing in degrees."""
    view = " ".join(f"{value:.2f}" for value in box)
    style = "" if text_deg is None else f' style="--size:{text_deg}px" class="degrees"'
    return (
        f'<svg viewBox="{view}" role="img" aria-label="{escape(label, quote=True)}"{style} '
        f'xmlns="http://www.w3.org/2000/svg">{"".join(parts)}</svg>'
    )


def _half_dot(pose: SweepPoseDocument, state: str, reason: str | None, *, bend: int) -> str:
    name = state if state in _STATES else "waiting"
    words = escape(f"{pose.ax_deg:.1f}°, {pose.ay_deg:.1f}°: {state}" + (f", {reason}" if reason else ""))
    start = f"M{pose.ax_deg:.3f} {pose.ay_deg - _DOT_DEG:.3f}"
    arc = f"a{_DOT_DEG} {_DOT_DEG} 0 0 {bend} 0 {2 * _DOT_DEG}z"
    return f'<path class="{name}" d="{start}{arc}"><title>{words}</title></path>'


def _grid(half: float, tall: float) -> str:
    steps_x, steps_y = np.arange(-5 * (half // 5), half, 5.0), np.arange(-5 * (tall // 5), tall, 5.0)
    lines = [f'<line class="grid" x1="{x:g}" x2="{x:g}" y1="{-tall:.2f}" y2="{tall:.2f}"/>' for x in steps_x]
    lines += [f'<line class="grid" y1="{y:g}" y2="{y:g}" x1="{-half:.2f}" x2="{half:.2f}"/>' for y in steps_y]
    lines += [_label(x + 0.1, tall - 0.15, f"{x:g}°") for x in steps_x]
    lines += [_label(-half + 0.1, y - 0.1, f"{y:g}°") for y in steps_y]
    return "".join(lines)


def _box(edges: Sequence[float] | NDArray[np.float64], kind: str) -> str:
    x0, x1, y0, y1 = (float(value) for value in edges)
    return f'<rect class="{kind}" x="{x0:.3f}" y="{y0:.3f}" width="{x1 - x0:.3f}" height="{y1 - y0:.3f}"/>'


def _outline(corners: NDArray[np.float64], kind: str) -> str:
    points = " ".join(f"{x:.3f},{y:.3f}" for x, y in corners)
    return f'<polygon class="{kind}" points="{points}"/>'


def _label(x: float, y: float, text: str) -> str:
    return f'<text x="{x:.2f}" y="{y:.2f}">{escape(text)}</text>'


def score_bars(models: Sequence[ModelScoreDocument]) -> str:
    """Return a bar chart of the leave-one-out error of every candidate, both axes together, logarithmic."""
    sizes = [math.hypot(*model.loo_deg) / math.sqrt(2.0) for model in models]
    logs = [math.log10(size) for size in sizes if size > 0.0] or [0.0]
    low, high = min(logs) - 0.3, max(logs)
    parts = []
    for row, (model, size) in enumerate(zip(models, sizes, strict=True)):
        share = (math.log10(size) - low) / (high - low) if size > 0.0 else 0.0
        parts.append(_score_bar(model, size, y=float(_BAR_PITCH * row), length=max(1.0, _BARS_WIDTH * share)))
    box = (0.0, 0.0, 680.0, _BAR_PITCH * len(models) + 4.0)
    return svg(parts, box, "leave-one-out error by model")


def drift_chart(checks: Sequence[DriftCheckDocument]) -> str:
    """Return a chart of the shifts of both eyes over the checks, in order, with their standard errors."""
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


def _score_bar(model: ModelScoreDocument, size_deg: float, *, y: float, length: float) -> str:
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


def _drift_marks(check: DriftCheckDocument, eye: DriftEyeDocument, *, x: float, per_deg: float) -> str:
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
