"""Diagram of how the mounts drifted while they were calibrated."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.mount_drift import S_PER_MIN, MountDrift

_DPI = 110
ACROSS, DOWN = "#1f4e79", "#b03a2e"


def drift_figure(drift: dict[Role, MountDrift], *, f_px: float) -> Figure:
    """Draw each eye's gaze against where it stood at the end, fovea px, over the minutes before."""
    figure = Figure(figsize=(9.6, 3.8), dpi=_DPI, layout="constrained")
    panels = figure.subplots(1, len(drift), sharey=True, squeeze=False)[0]
    for axes, (role, mount) in zip(panels, drift.items(), strict=True):
        _draw(axes, mount, f_px=f_px)
        axes.set_title(f"{role} eye: {f_px * mount.rad_per_minute:.2f} px a minute", fontsize=10)
        axes.set_xlabel("minutes before the end of the last run")
    panels[0].set_ylabel("gaze against the end, fovea px")
    panels[0].legend(fontsize=8, frameon=False)
    return figure


def _draw(axes: Axes, mount: MountDrift, *, f_px: float) -> None:
    """Draw the last run; earlier ones are on clocks of their own."""
    run = mount.runs[-1]
    minutes = (run.knots_s - run.knots_s[-1]) / S_PER_MIN
    gaze = f_px * np.column_stack([run.turn_rad[:, 1], -run.turn_rad[:, 0]])
    sigma = f_px * run.sigma_rad[:, ::-1]
    for column, (name, colour) in enumerate((("across", ACROSS), ("down", DOWN))):
        axes.errorbar(
            minutes,
            gaze[:, column],
            yerr=sigma[:, column],
            fmt="o-",
            ms=3,
            color=colour,
            label=name,
            capsize=2,
        )
    axes.axhline(0.0, color="0.6", linewidth=0.7)
