"""Diagrams of a fit as PNG: residuals at every pose, model errors, image warps, drift of the mounts."""

import io
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.mirror_models import MirrorModelFamily, MirrorScore
from foveacam_pipeline.calibrate.fit.samples import S_PER_MIN, DriftRun, MountDrift
from foveacam_pipeline.calibrate.fit.session_fit import FitResult
from foveacam_pipeline.diagrams import new_figure
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DPI = 110
_ARROW_DEG = 0.5
"""Length of a typical residual in a picture."""
BLUE, RED, GREEN, GREY = "#1f4e79", "#b03a2e", "#1e8449", "0.45"
_WARP_SIDE = 5
_LINES = 7
_RIM = 0.985
"""Share of the calibrated volts at which the outermost grids are drawn."""
_LEAST_GAP_MIN, _GAP_SHARE = 0.1, 0.05
_LEAST_LABEL_PX = 0.05
ACROSS, DOWN, KNOCK = "#1f4e79", "#b03a2e", "#b9770e"


def fit_pictures(result: FitResult) -> dict[str, Callable[[], bytes]]:
    """Return the function that draws each picture of a fit, by the name of its file."""
    eyes = (Role.LEFT, Role.RIGHT)
    quivers = {f"quiver_{role}": lambda role=role: quiver_picture(result, role) for role in eyes}
    warps = {f"warp_{role}": lambda role=role: warp_picture(result.calibration, role) for role in eyes}
    pictures = {**quivers, "loo": lambda: models_picture(result), **warps}
    drift = result.drift
    if drift is None:
        return pictures
    f_px = result.calibration.fovea_f_px
    return {"mount_drift": lambda: png(drift_figure(drift, f_px=f_px)), **pictures}


def quiver_picture(result: FitResult, role: Role) -> bytes:
    """Return a PNG of the chosen model's leave-one-out gaze residual at each pose, enlarged."""
    fit, f_px = result.fit, result.calibration.fovea_f_px
    mirror, eye = fit.mirrors[role], fit.sweeps[role]
    places = np.rad2deg(mirror.model.angles_of(eye.volts_v))
    missed = f_px * mirror.loo_residuals_rad
    inliers = (mirror.weights > 0.5).all(axis=1)
    rms_px = float(np.sqrt(np.mean(np.sum(missed[inliers] ** 2, axis=1))))
    scale = _ARROW_DEG / max(rms_px, 1e-9)
    figure = new_figure((7.6, 7.0), dpi=_DPI)
    axes = figure.subplots()
    station = result.measured.nodes[role][:, 0]
    for k, parallax in enumerate(result.parallax):
        rows = station == k
        arrows = scale * missed[rows]
        colour = (BLUE, RED, GREEN)[k % 3]
        axes.quiver(
            *places[rows].T,
            *arrows.T,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            width=0.0025,
            color=colour,
            label=parallax.station,
        )
    axes.plot(*places[~inliers].T, "o", mfc="none", color=GREY, label="counts less (robust)")
    hull = np.rad2deg(np.vstack([mirror.model.hull_rad, mirror.model.hull_rad[:1]]))
    axes.plot(*hull.T, "-", color=GREY, linewidth=0.8, label="calibrated field")
    _field_axes(
        axes,
        f"{role} eye, {mirror.chosen.name}: {rms_px:.2f} fovea px rms left out; arrows {scale:.1f}° a px",
    )
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=3, frameon=False)
    return png(figure)


def models_picture(result: FitResult) -> bytes:
    """Return a PNG of the leave-one-out errors of every model of both mirrors and of every rectification."""
    figure = new_figure((11.5, 4.6), dpi=_DPI)
    mirrors, fields = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    f_px = result.calibration.fovea_f_px
    for role, colour in ((Role.LEFT, BLUE), (Role.RIGHT, RED)):
        for family, line in ((MirrorModelFamily.POLYNOMIAL, "o-"), (MirrorModelFamily.SPRINGS, "s--")):
            scores = [score for score in result.models[role] if score.family is family]
            errors = [f_px * float(np.hypot(*score.loo_rad)) for score in scores]
            name = "polynomial" if family is MirrorModelFamily.POLYNOMIAL else "springs + polynomial"
            label = f"{role}: {name}"
            mirrors.plot([s.order for s in scores], errors, line, color=colour, label=label, markersize=4)
            _mark(mirrors, scores, errors, colour)
        orders = result.fit.fields[role].scores
        fields.plot(
            [s.order for s in orders], [s.loo_px for s in orders], "o-", color=colour, label=str(role)
        )
        chosen = next(score for score in orders if score.chosen)
        fields.plot(chosen.order, chosen.loo_px, "o", color=colour, markersize=11, mfc="none")
    mirrors.axvline(3, color=GREY, linestyle=":", linewidth=1.0)
    mirrors.text(
        3.05, 0.97, " the paper's cubic", transform=mirrors.get_xaxis_transform(), va="top", fontsize=8
    )
    mirrors.set(
        title="mirror: angle of a node left out", xlabel="order of the polynomial", ylabel="fovea px rms"
    )
    fields.set(title="rectification: corners of a pose left out", xlabel="order of the polynomial")
    fields.set_ylabel("fovea px rms")
    for axes in (mirrors, fields):
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.set_yscale("log")
        axes.grid(visible=True, which="both", alpha=0.25)
        axes.legend(fontsize=8)
    figure.suptitle("Circled: elected", fontsize=10)
    return png(figure)


def warp_picture(calibration: Calibration, role: Role) -> bytes:
    """Return a PNG of a square grid, raw and rectified (Eq. 4), at gazes over the field."""
    mirror = calibration.eye(role).mirror
    line = np.linspace(-_RIM, _RIM, _WARP_SIDE)
    gazes = mirror.angles_of(np.array([(x, y) for y in line for x in line]) * np.array(mirror.max_v))
    figure = new_figure((9.0, 7.6), dpi=_DPI)
    axes = figure.subplots()
    grids = [_grid(calibration, role, (ax_rad, ay_rad)) for ax_rad, ay_rad in gazes.tolist()]
    raw, rectified = (np.concatenate(lines) for lines in zip(*grids, strict=True))
    axes.plot(*raw.T, "-", color="0.75", linewidth=0.6)
    axes.plot(*rectified.T, "-", color=BLUE, linewidth=0.8)
    _field_axes(axes, f"{role} eye: the images as read out (grey) and as rectified (blue), in their places")
    return png(figure)


def _grid(
    calibration: Calibration, role: Role, gaze_rad: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lines of one image's grid about its gaze, deg, as read out and as rectified.

    Each is (n, 2), with a row of NaN after every line: many lines are drawn as one, in a tenth of the time.
    """
    width, height = calibration.fovea_width - 1.0, calibration.fovea_height - 1.0
    homography = calibration.eye(role).homography.at(*gaze_rad)
    scale = float(np.rad2deg(1.0 / calibration.fovea_f_px))
    middle = np.rad2deg(gaze_rad)
    along, gap = np.linspace(0.0, 1.0, 21), np.full((1, 2), np.nan)
    raw, rectified = [], []
    for share in np.linspace(0.0, 1.0, _LINES):
        across = np.column_stack([along * width, np.full(21, share * height)])
        down = np.column_stack([np.full(21, share * width), along * height])
        for line in (across, down):
            plain = line - np.array([width, height]) / 2.0
            raw += [middle + scale * plain, gap]
            rectified += [middle + scale * homography_apply(homography, line), gap]
    return np.concatenate(raw), np.concatenate(rectified)


def _mark(axes: "Axes", scores: list[MirrorScore], errors: list[float], colour: str) -> None:
    for score, error in zip(scores, errors, strict=True):
        if score.chosen:
            axes.plot(score.order, error, "o", color=colour, markersize=11, mfc="none")


def _field_axes(axes: "Axes", title: str) -> None:
    axes.set(xlabel="ax, deg (right)", ylabel="ay, deg (down)", title=title)
    axes.title.set_fontsize(10)
    axes.set_aspect("equal")
    if not axes.yaxis_inverted():
        axes.invert_yaxis()
    axes.grid(visible=True, alpha=0.25)


def png(figure: "Figure") -> bytes:
    """Return a figure as PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", facecolor="white")
    return buffer.getvalue()


def drift_figure(drift: dict[Role, MountDrift], *, f_px: float) -> "Figure":
    """Return the figure of each eye's gaze against its end, fovea px, over the minutes.

    Runs are drawn one after the other without the time between them, because their clocks may differ. The
    distance of a run's end from the last run's end is written above it.
    """
    figure = new_figure((9.6, 3.8), dpi=_DPI)
    panels = figure.subplots(1, len(drift), sharey=True, squeeze=False)[0]
    for axes, (role, mount) in zip(panels, drift.items(), strict=True):
        _draw_drift(axes, mount, f_px=f_px)
        axes.set_title(f"{role} eye: {f_px * mount.rad_per_minute:.2f} px a minute", fontsize=10)
        axes.set_xlabel("minutes of measuring before the end")
    panels[0].set_ylabel("gaze against the end of the run, fovea px")
    panels[0].legend(fontsize=8, frameon=False)
    return figure


def _draw_drift(axes: "Axes", mount: MountDrift, *, f_px: float) -> None:
    """Draw all runs; the last one ends at zero."""
    axes.axhline(0.0, color="0.6", linewidth=0.7)
    axes.margins(y=0.15)  # room for the text above
    end_min, gap_min = 0.0, max(_LEAST_GAP_MIN, _GAP_SHARE * mount.minutes)
    for before, run in reversed(list(pairwise([mount.runs[0], *mount.runs]))):
        _draw_drift_run(axes, run, end_min=end_min, f_px=f_px, named=run is mount.runs[-1])
        end_min -= run.minutes + gap_min
        if run is not mount.runs[0]:
            _draw_gap(axes, end_min + gap_min / 2.0, knocked=before.knocked)


def _draw_gap(axes: "Axes", at_min: float, *, knocked: bool) -> None:
    """Draw the line between two runs: a gap in time, or a knock."""
    colour, style = (KNOCK, "-") if knocked else ("0.8", ":")
    axes.axvline(at_min, color=colour, linewidth=0.7, linestyle=style)
    if knocked:
        axes.text(
            at_min,
            0.02,
            " knock",
            transform=axes.get_xaxis_transform(),
            fontsize=8,
            color=colour,
            rotation=90,
            ha="right",
            va="bottom",
        )


def _draw_drift_run(axes: "Axes", run: DriftRun, *, end_min: float, f_px: float, named: bool) -> None:
    """Draw one run; `named`: with its lines in the legend."""
    minutes = end_min + (run.knots_s - run.knots_s[-1]) / S_PER_MIN
    gaze = f_px * np.column_stack([run.turn_rad[:, 1], -run.turn_rad[:, 0]])
    sigma = f_px * run.sigma_rad[:, ::-1]
    for column, (name, colour) in enumerate((("across", ACROSS), ("down", DOWN))):
        axes.errorbar(
            minutes,
            gaze[:, column] - gaze[-1, column],
            yerr=sigma[:, column],
            fmt="o-",
            ms=3,
            color=colour,
            label=name if named else None,
            capsize=2,
        )
    away_px = float(np.linalg.norm(gaze[-1]))
    if away_px > _LEAST_LABEL_PX:
        middle_min = float(minutes[0] + minutes[-1]) / 2.0
        axes.annotate(
            f"{away_px:.1f} px off",
            (middle_min, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, -4),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=8,
            color="0.3",
        )
