"""The pictures of an acceptance run, as PNG."""

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.accept.geometry import StationMeasure
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.repeatability import SIDES, Returns
from foveacam_pipeline.accept.rig_under_test import frame_of, shades_of
from foveacam_pipeline.accept.sensors import SensorFrames, photon_transfer
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, draw_markers
from foveacam_pipeline.calibrate.sweep.markers import find_markers
from foveacam_pipeline.diagrams import new_figure
from foveacam_pipeline.stereo.rectify import to_uint8

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 110
LIMITS = AcceptanceLimits()
COLOURS = {Role.WIDE: "#4d4d4d", Role.LEFT: "#1f77b4", Role.RIGHT: "#d95f02"}
SIDE_NAMES = ("from the right", "from the left", "from below", "from above")
GAP_PX = 8
LABEL_PX, FONT = (14, 40), cv2.FONT_HERSHEY_SIMPLEX


def draw_pictures(sighting: Sighting, layout: MarkerLayout) -> bytes:
    """Return the three pictures side by side, left, wide, right, with the markers that are read in them."""
    shown = [_annotated(sighting, role, layout) for role in (Role.LEFT, Role.WIDE, Role.RIGHT)]
    gap = np.full((shown[0].shape[0], GAP_PX, 3), 255, dtype=np.uint8)
    row = np.hstack([shown[0], gap, shown[1], gap, shown[2]])
    _, encoded = cv2.imencode(".png", cv2.cvtColor(row, cv2.COLOR_RGB2BGR))
    return encoded.tobytes()


def _annotated(sighting: Sighting, role: Role, layout: MarkerLayout) -> NDArray[np.uint8]:
    frame = frame_of(sighting, role)
    shades, large = shades_of(frame), role is not Role.WIDE
    views = find_markers(shades, side_m=layout.side_m, large=large, only=layout.ids, binning=frame.binning)
    picture = draw_markers(
        to_uint8(frame), list(views.values()), accepted=bool(views), aim_px=None, binning=frame.binning
    )
    cv2.putText(picture, f"arrives as {role}", LABEL_PX, FONT, 1.0, (0, 0, 0), 6, cv2.LINE_AA)
    cv2.putText(picture, f"arrives as {role}", LABEL_PX, FONT, 1.0, (255, 255, 255), 2, cv2.LINE_AA)
    return picture


def draw_noise(frames: Mapping[Role, SensorFrames]) -> bytes:
    """Return the photon transfer curves of the three cameras."""
    figure = new_figure((8.0, 4.6), dpi=DPI)
    axes = figure.subplots()
    for role, taken in frames.items():
        levels, variances = photon_transfer(taken)
        axes.plot(levels, variances, "o-", color=COLOURS[role], label=str(role), markersize=4)
    axes.set_xlabel("level above black, grey levels of 8 bits")
    axes.set_ylabel("variance between two pictures, grey levels²")
    axes.set_title("noise by brightness", fontsize=10)
    axes.set_ylim(bottom=0.0)
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=8)
    return _png(figure)


def draw_returns(returns: Returns) -> bytes:
    """Return where both gazes came to rest, by the side from which they came; dashed: limit of scatter."""
    from matplotlib.patches import Circle  # a server's start has no use for it

    figure = new_figure((8.0, 4.4), dpi=DPI)
    for index, axes in enumerate(figure.subplots(1, 2)):
        own = 1e3 * (returns.places_deg - returns.places_deg.mean(axis=0))[:, 2 * index : 2 * index + 2]
        for side in range(len(SIDES)):
            places = own[returns.sides == side]
            axes.plot(places[:, 0], places[:, 1], "o", label=SIDE_NAMES[side], markersize=5, alpha=0.8)
        limit = 1e3 * LIMITS.scatter_deg
        reach = 1.25 * max(float(np.abs(own).max()), limit)
        axes.add_patch(Circle((0.0, 0.0), limit, fill=False, color="0.5", linestyle="--"))
        axes.set_xlim(-reach, reach)
        axes.set_ylim(reach, -reach)
        axes.set_aspect("equal")
        axes.set_title(("left eye", "right eye")[index], fontsize=10)
        axes.set_xlabel("to the right, thousandths of a degree")
        axes.set_ylabel("down, thousandths of a degree")
        axes.grid(visible=True, alpha=0.3)
    figure.axes[0].legend(fontsize=7)
    return _png(figure)


def draw_distances(measures: Sequence[StationMeasure]) -> bytes:
    """Return the distances by gazes and by print against those by tape."""
    figure = new_figure((8.0, 1.6 + 0.7 * len(measures)), dpi=DPI)
    axes = figure.subplots()
    rows = np.arange(len(measures))
    gazes = [100.0 * one.stereo_rel for one in measures]
    sigmas = [100.0 * one.stereo_sigma_m / one.z_m for one in measures]
    axes.errorbar(gazes, rows - 0.1, xerr=sigmas, fmt="o", color="#1f77b4", label="by the two gazes ± σ")
    axes.plot(
        [100.0 * one.printed_rel for one in measures], rows + 0.1, "s", color="#d95f02", label="by the print"
    )
    axes.axvline(0.0, color="0.4", linewidth=0.8)
    limit = 100.0 * LIMITS.scale_rel
    axes.axvspan(-limit, limit, color="0.9", label="allowed")
    largest = max(abs(one.stereo_rel) for one in measures), max(abs(one.printed_rel) for one in measures)
    reach = 1.3 * max(100.0 * max(largest), 2.0 * limit)
    axes.set_xlim(-reach, reach)
    axes.set_yticks(rows, [f"{one.name}, {one.z_m:.2f} m" for one in measures])
    axes.set_ylim(len(measures) - 0.5, -0.5)
    axes.set_xlabel("difference from the tape, %")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=8)
    return _png(figure)


def _png(figure: "Figure") -> bytes:
    content = io.BytesIO()
    figure.savefig(content, format="png")
    return content.getvalue()
