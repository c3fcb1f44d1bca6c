"""Diagrams of stage 1 as PNG: coverage and tilts of the board, residuals of the lens model."""

import io
from typing import TYPE_CHECKING

import numpy as np

from foveacam_pipeline.calibrate.wide.board_pose import TILTS, pose_of_view
from foveacam_pipeline.calibrate.wide.coverage import COLUMNS, ROWS, coverage_of
from foveacam_pipeline.calibrate.wide.fit_wide import WideFit
from foveacam_pipeline.calibrate.wide.lens_accuracy import GRID
from foveacam_pipeline.calibrate.wide.wide_samples import WideSamples
from foveacam_pipeline.diagrams import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ARROW = 0.04
"""Length of a typical residual in a picture, over the image's width."""


def coverage_picture(samples: WideSamples, fit: WideFit | None = None) -> bytes:
    """Return a PNG of the views in each part of the image with all corners, and of the tilts."""
    lens = None if fit is None else fit.intrinsics
    views = [sample.view for sample in samples]
    cover = coverage_of(views, lens)
    width, height = samples.size
    figure = new_figure((11.0, 4.4))
    image, tilts = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
    _frame(image, width, height)
    extent = (-0.5, width - 0.5, height - 0.5, -0.5)
    shown = image.imshow(cover.cells, extent=extent, cmap="Greens", vmin=0, aspect="equal")
    figure.colorbar(shown, ax=image, label="views", shrink=0.8)
    for view in views:
        image.plot(*view.corners_px.T, ".", markersize=1.5, color="#1f4e79", alpha=0.6)
    image.set_title(f"{100 * cover.fraction:.0f} % of {COLUMNS} x {ROWS} parts covered by {len(views)} views")
    leans = np.array([np.degrees(np.arcsin(pose_of_view(view, lens).lean[:2])) for view in views])
    tilts.plot(*-leans.T, "o", color="#1f4e79", alpha=0.7)
    most = 1.1 * max(30.0, float(np.abs(leans).max()))
    tilts.set(
        xlim=(-most, most), ylim=(most, -most), xlabel="right side nearer, deg", ylabel="bottom nearer, deg"
    )
    tilts.set_aspect("equal")
    tilts.grid(visible=True, alpha=0.3)
    tilts.set_title(f"tilt of the board: {cover.tilts_covered} of {len(TILTS)} kinds")
    return _png(figure)


def residuals_picture(samples: WideSamples, fit: WideFit) -> bytes:
    """Return a PNG of the enlarged residuals of all corners, the rms of every view, and the accuracy."""
    width, height = samples.size
    figure = new_figure((13.0, 4.2))
    arrows, bars, sure = figure.subplots(1, 3, width_ratios=(1.3, 0.8, 1.3))
    _frame(arrows, width, height)
    corners = np.concatenate([view.corners_px for view in fit.views])
    residuals = np.concatenate([view.residuals_px for view in fit.views])
    enlarged = _ARROW * width / max(fit.rms_px, 1e-6)
    arrows.quiver(
        *corners.T,
        *(residuals * enlarged).T,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        width=0.002,
        color="#b03a2e",
    )
    arrows.set_title(f"residuals x {enlarged:.0f}: {fit.rms_px:.3f} px rms, {fit.model}")
    bars.bar(range(len(fit.views)), [view.rms_px for view in fit.views], color="#1f4e79")
    bars.axhline(fit.rms_px, color="#b03a2e", linewidth=1.0)
    bars.set(xlabel="view", ylabel="rms, px", title="by view")
    _frame(sure, width, height)
    x, y = np.linspace(-0.5, width - 0.5, GRID[0]), np.linspace(-0.5, height - 0.5, GRID[1])
    shades = sure.contourf(x, y, fit.accuracy.map_px, levels=12, cmap="viridis")
    figure.colorbar(shades, ax=sure, label="px")
    sure.set_title(f"standard error of a pixel: {fit.accuracy.sigma_px:.3f} px rms")
    return _png(figure)


def _frame(axes: "Axes", width: int, height: int) -> None:
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="x, px", ylabel="y, px")
    axes.set_aspect("equal")


def _png(figure: "Figure") -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    return buffer.getvalue()
