"""The picture of a comparison: where the gazes, the rows and the wide pixels of two calibrations differ."""

import io
import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foveacam_pipeline.calibrate.records.compare import CalibrationComparison

_DPI = 110
_CELLS_LONG = 1.3
"""Length of the longest arrow, in distances of the nodes."""
_LEAST_PX = 1e-9


def comparison_picture(comparison: CalibrationComparison) -> bytes:
    """Return a PNG: arrows for both eyes, row mismatch over the field, arrows over the wide image."""
    figure = Figure(figsize=(11.0, 8.6), dpi=_DPI, layout="constrained")
    axes = figure.subplots(2, 2)
    at = np.rad2deg(comparison.directions_rad)
    _draw_arrows(axes[0, 0], at, comparison.gaze_left_px, title="left gaze, fovea px")
    _draw_arrows(axes[0, 1], at, comparison.gaze_right_px, title="right gaze, fovea px")
    _draw_rows(figure, axes[1, 0], at, comparison.epipolar_px)
    _draw_arrows(axes[1, 1], comparison.wide_at_px, comparison.wide_px, title="wide camera, px")
    for axis in (axes[0, 0], axes[0, 1], axes[1, 0]):
        axis.set_xlabel("ax, °")
        axis.set_ylabel("ay, °")
    axes[1, 1].set_xlabel("x, px")
    axes[1, 1].set_ylabel("y, px")
    figure.suptitle(
        f"{comparison.b} against {comparison.a} at {comparison.distance_m:g} m\n"
        f"gaze {comparison.pointing.rms_px:.2f} px rms, rows {comparison.epipolar.rms_px:.2f} px rms, "
        f"baseline {1e3 * comparison.baseline_m:+.2f} mm",
        fontsize=11,
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _draw_arrows(axis: Axes, at: NDArray[np.float64], px: NDArray[np.float64], *, title: str) -> None:
    length = np.linalg.norm(px, axis=1)
    longest = max(float(length.max()), _LEAST_PX) * math.sqrt(len(at)) / _CELLS_LONG
    x, y, dx, dy = at[:, 0], at[:, 1], px[:, 0], px[:, 1]
    colours = axis.quiver(x, y, dx, dy, length, angles="xy", scale=longest, cmap="viridis")
    figure = axis.get_figure()
    if figure is not None:
        figure.colorbar(colours, ax=axis, shrink=0.8)
    rms = float(np.sqrt(np.mean(length**2)))
    axis.set_title(f"{title}: {rms:.2f} rms, {float(length.max()):.2f} at most", fontsize=10)
    axis.invert_yaxis()
    axis.set_aspect("equal")


def _draw_rows(figure: Figure, axis: Axes, at: NDArray[np.float64], px: NDArray[np.float64]) -> None:
    dots = axis.scatter(at[:, 0], at[:, 1], c=px, s=150, marker="s", cmap="magma")
    figure.colorbar(dots, ax=axis, shrink=0.8)
    axis.set_title("row mismatch between the eyes, fovea px", fontsize=10)
    axis.invert_yaxis()
    axis.set_aspect("equal")
