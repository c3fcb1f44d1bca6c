"""Drawings of a report that need no plotting: fields of view and poses of a sweep, in the page's colours."""

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.report.facts import NodeFacts, SweepFacts
from foveacam_pipeline.models.calibration import Calibration

_PAPER_HALF_DEG = 10.0  # Table 2: actuation range 20° x 20°
_STATES = ("centred", "rim", "refused", "waiting")
_DOT_DEG = 0.32


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


def sweep_drawing(sweep: SweepFacts) -> str:
    """Return the poses of a sweep: the left half of a dot is the left eye's, the right half the other's."""
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
    """Return an SVG over `box` (x, y, width, height); `text_deg`: size of words where it is in degrees."""
    view = " ".join(f"{value:.2f}" for value in box)
    style = "" if text_deg is None else f' style="--size:{text_deg}px" class="degrees"'
    return (
        f'<svg viewBox="{view}" role="img" aria-label="{escape(label, quote=True)}"{style} '
        f'xmlns="http://www.w3.org/2000/svg">{"".join(parts)}</svg>'
    )


def _half_dot(pose: NodeFacts, state: str, reason: str | None, *, bend: int) -> str:
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
