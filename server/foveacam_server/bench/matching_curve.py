"""The picture of a matcher's bias over the sub-pixel phase, as SVG."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT, LEFT, TOP = 640, 300, 70, 40
FULL_SCALE_PX = 0.006
COLOURS = ("#1f6fb4", "#c8511b", "#3a8a3a")


def write_curve(path: Path, phases: Sequence[float], curves: Mapping[str, NDArray[np.float64]]) -> None:
    """Write the curves with the limit of ±0.005 px; what exceeds the scale is drawn at its end."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
        'font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        f'<text x="{LEFT}" y="22" font-size="14">Bias of a match over the sub-pixel phase</text>',
    ]
    for level_px in (-0.005, -0.0025, 0.0, 0.0025, 0.005):
        y, dash = _y(level_px), ' stroke-dasharray="5 4"' if abs(level_px) == 0.005 else ""
        parts.append(
            f'<line x1="{LEFT}" x2="{WIDTH - 20}" y1="{y:.1f}" y2="{y:.1f}" stroke="#999"{dash}/>'
            f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{level_px:g} px</text>'
        )
    for phase in (0.0, 0.25, 0.5, 0.75, 1.0):
        parts.append(f'<text x="{_x(phase):.1f}" y="{HEIGHT - 32}" text-anchor="middle">{phase:g}</text>')
    parts.append(f'<text x="{WIDTH / 2}" y="{HEIGHT - 12}" text-anchor="middle">phase along x, px</text>')
    for k, (name, curve) in enumerate(curves.items()):
        points = " ".join(f"{_x(p):.1f},{_y(v):.1f}" for p, v in zip(phases, curve.tolist(), strict=True))
        colour = COLOURS[k % len(COLOURS)]
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts.append(f'<text x="{360 + 140 * k}" y="22" fill="{colour}">{name}</text>')
    path.write_text("\n".join([*parts, "</svg>\n"]), encoding="utf-8")


def _x(phase: float) -> float:
    return LEFT + phase * (WIDTH - LEFT - 30)


def _y(bias_px: float) -> float:
    middle = TOP + (HEIGHT - TOP - 50) / 2
    return middle - max(-1.0, min(1.0, bias_px / FULL_SCALE_PX)) * (HEIGHT - TOP - 50) / 2
