"""Diagrams of the fits, as PNG: what a mirror model leaves, who was elected, how the rectification bends."""

import io
import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit import RigFit
from foveacam_pipeline.calibrate.mirror_models import Family
from foveacam_pipeline.geometry.pinhole import homography_apply
from foveacam_pipeline.models.calibration import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EYE_COLORS = {Role.LEFT: "#1769c4", Role.RIGHT: "#b8560b"}
ARROW_DEG = 0.8
"""Length of the arrow of a typical residual."""
WARP_NODES = 7
WARP_SHARE = 0.11
"""Size of a warped frame in the diagram, over the field's width."""
FRAME_STEPS = 9


def quiver_picture(fit: RigFit, role: Role) -> bytes:
    """Return a PNG: residual of every pose, as fitted (arrows) and when it is left out (rings)."""
    mirror, sweep = fit.mirrors[role], fit.sweeps[role]
    f_px = fit.calibration.fovea_f_px
    at_deg = np.rad2deg(sweep.angles_rad)
    left_px, out_px = f_px * mirror.residuals_rad, f_px * mirror.loo_residuals_rad
    rms_px = max(float(np.sqrt(np.mean(np.sum(left_px**2, axis=1)))), 1e-6)
    scale = ARROW_DEG / rms_px
    figure = Figure(figsize=(9.0, 7.2), layout="constrained")
    axes = figure.add_subplot()
    _field(axes)
    axes.quiver(
        *at_deg.T,
        *(scale * left_px).T,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        width=0.0025,
        color=EYE_COLORS[role],
    )
    tips = at_deg + scale * out_px
    axes.plot(*tips.T, "o", markersize=3.0, markerfacecolor="none", color="#6b7280", label="left out")
    outliers = (mirror.weights < 0.5).any(axis=1)
    axes.plot(*at_deg[outliers].T, "x", color="#b03a2e", label=f"outliers ({int(outliers.sum())})")
    axes.legend(loc="upper right", fontsize=8)
    x_deg, y_deg = (math.degrees(value) for value in mirror.chosen.loo_rad)
    axes.set_title(
        f"{role} eye, {mirror.chosen.name}: {rms_px:.2f} fovea px rms (arrows × {scale:.1f} °/px); "
        f"left out {x_deg:.4f}°, {y_deg:.4f}°"
    )
    return _png(figure)


def election_picture(fit: RigFit) -> bytes:
    """Return a PNG: leave-one-out error by the number of terms, mirrors and rectifications."""
    figure = Figure(figsize=(11.0, 4.4), layout="constrained")
    mirrors, fields = figure.subplots(1, 2)
    for role, color in EYE_COLORS.items():
        for family, style in ((Family.POLYNOMIAL, "-o"), (Family.SPRINGS, "--s")):
            scores = [score for score in fit.mirrors[role].scores if score.family is family]
            errors = [fit.calibration.fovea_f_px * math.hypot(*score.loo_rad) for score in scores]
            orders = [score.order for score in scores]
            mirrors.semilogy(
                orders, errors, style, color=color, label=f"{role}, {family.value}", markersize=4
            )
        chosen = fit.mirrors[role].chosen
        error_px = fit.calibration.fovea_f_px * math.hypot(*chosen.loo_rad)
        mirrors.plot(chosen.order, error_px, "*", color=color, markersize=14)
        ranks = [score.order for score in fit.fields[role].scores]
        fields.semilogy(
            ranks, [s.loo_px for s in fit.fields[role].scores], "-o", color=color, label=str(role)
        )
        field = fit.calibration.eye(role).homography
        fields.plot(field.polynomial.order, field.loo_px, "*", color=color, markersize=14)
    mirrors.set(xlabel="order", ylabel="left out, fovea px", title="volts to angle (star: elected)")
    fields.set(xlabel="order", ylabel="left out, fovea px", title="rectification (star: elected)")
    for axes in (mirrors, fields):
        axes.grid(visible=True, which="both", alpha=0.25)
        axes.legend(fontsize=8)
    return _png(figure)


def warp_picture(calibration: Calibration, role: Role) -> bytes:
    """Return a PNG: the fovea's frame as each gaze of a grid bends it, against the upright frame."""
    eye = calibration.eye(role)
    hull_deg = np.rad2deg(eye.mirror.hull_rad)
    low, high = eye.mirror.hull_rad.min(axis=0), eye.mirror.hull_rad.max(axis=0)
    figure = Figure(figsize=(9.0, 7.2), layout="constrained")
    axes = figure.add_subplot()
    _field(axes)
    axes.fill(*hull_deg.T, color=EYE_COLORS[role], alpha=0.08)
    frame = _frame_px(calibration.fovea_width, calibration.fovea_height)
    centre = np.array([(calibration.fovea_width - 1) / 2.0, (calibration.fovea_height - 1) / 2.0])
    scale = WARP_SHARE * math.degrees(float(high[0] - low[0])) / calibration.fovea_width
    nodes = np.array(
        [
            (x, y)
            for y in np.linspace(low[1], high[1], WARP_NODES)
            for x in np.linspace(low[0], high[0], WARP_NODES)
        ]
    )
    for gaze in nodes[eye.mirror.inside(nodes)]:
        bent = homography_apply(eye.homography.at(float(gaze[0]), float(gaze[1])), frame)
        at_deg = np.rad2deg(gaze)
        axes.plot(*(at_deg + scale * (frame - centre)).T, color="#9aa3ad", linewidth=0.7)
        axes.plot(*(at_deg + scale * bent).T, color=EYE_COLORS[role], linewidth=1.2)
    axes.set_title(
        f"{role} eye: the frame on the virtual pinhole (grey: unbent), order {eye.homography.polynomial.order}, "
        f"left out {eye.homography.loo_px:.3f} px"
    )
    return _png(figure)


def _frame_px(width: int, height: int) -> NDArray[np.float64]:
    """Return the (n, 2) outline of an image with its two middle lines' crossing marked by the start."""
    corners = np.array(
        [(0.0, 0.0), (width - 1.0, 0.0), (width - 1.0, height - 1.0), (0.0, height - 1.0), (0.0, 0.0)]
    )
    steps = np.linspace(0.0, 1.0, FRAME_STEPS)[:, None]
    sides = [start + steps * (end - start) for start, end in zip(corners[:-1], corners[1:], strict=True)]
    return np.concatenate(sides)


def _field(axes: "Axes") -> None:
    axes.set(xlabel="ax, deg", ylabel="ay, deg (down)")
    axes.invert_yaxis()
    axes.set_aspect("equal")
    axes.grid(visible=True, alpha=0.25)


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(buffer, format="png", dpi=110)
    return buffer.getvalue()
