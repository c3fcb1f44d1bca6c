"""The pictures of an acceptance run, as PNG."""

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.accept.axes import NOMINAL_GAIN_DEG_PER_V, AxisResponse
from foveacam_pipeline.accept.geometry import StationMeasure
from foveacam_pipeline.accept.light import LightSamples
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.repeatability import SIDES, RestPlaces, Returns
from foveacam_pipeline.accept.rig_under_test import EYES, frame_of, other_eye, shades_of
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


def draw_rest(places: RestPlaces) -> bytes:
    """Return how far both gazes move while nothing does; dashed: the limit."""
    figure = new_figure((8.0, 3.2), dpi=DPI)
    axes, limit = figure.subplots(), 1e3 * LIMITS.rest_deg
    off = 1e3 * (places.places_deg - places.places_deg.mean(axis=0))
    for index, (role, axis) in enumerate((role, axis) for role in EYES for axis in "xy"):
        style = "o-" if axis == "x" else "s--"
        axes.plot(
            places.t_s - places.t_s[0], off[:, index], style, color=COLOURS[role], label=f"{role} {axis}"
        )
    for edge in (-limit, limit):
        axes.axhline(edge, color="0.5", linestyle=":")
    axes.set_xlabel("time, s")
    axes.set_ylabel("thousandths of a degree")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(fontsize=7, ncols=4)
    return _png(figure)


def draw_axes(response: AxisResponse) -> bytes:
    """Return the motion of both gazes by one volt on each axis, beside the motion by the design."""
    figure = new_figure((8.0, 4.0), dpi=DPI)
    for axes, role in zip(figure.subplots(1, 2), EYES, strict=True):
        for axis, (name, colour) in enumerate((("x", "#1f77b4"), ("y", "#d95f02"))):
            for driven, shade in ((role, 1.0), (other_eye(role), 0.35)):
                x, y = (1e3 * response.block(role, driven)[:, axis]).tolist()
                axes.plot([0.0, x], [0.0, y], color=colour, alpha=shade, linewidth=2.0)
                axes.plot([x], [y], "o", color=colour, alpha=shade, markersize=6, label=f"{driven} {name}")
            ideal = 1e3 * NOMINAL_GAIN_DEG_PER_V[axis] * np.eye(2)[axis]
            axes.plot(*ideal, "k+", markersize=10)
        axes.set_xlim(-80.0, 80.0)
        axes.set_ylim(80.0, -80.0)
        axes.set_aspect("equal")
        axes.set_title(f"{role} gaze; + by the design", fontsize=10)
        axes.set_xlabel("to the right, thousandths of a degree a volt")
        axes.grid(visible=True, alpha=0.3)
        axes.legend(fontsize=7)
    return _png(figure)


def draw_light(samples: LightSamples) -> bytes:
    """Return the level of white paper in the middle and towards the corners of each picture."""
    figure = new_figure((8.0, 3.2), dpi=DPI)
    axes = figure.subplots()
    for place, role in enumerate(samples.middle):
        corners = samples.corners.get(role, [])
        heights = [samples.middle[role], *corners]
        axes.bar(place + 0.16 * np.arange(len(heights)) - 0.32, heights, 0.14, color=COLOURS[role])
    axes.set_xticks(range(len(samples.middle)), [f"{role}: middle, corners" for role in samples.middle])
    axes.set_ylabel("white paper, of 255")
    axes.set_ylim(0.0, 255.0)
    axes.grid(visible=True, axis="y", alpha=0.3)
    return _png(figure)


def draw_frames(wide: NDArray[np.int64]) -> bytes:
    """Return the time between the wide frames that came, (n, 2) number and ns; gaps are frames lost."""
    figure = new_figure((8.0, 3.0), dpi=DPI)
    axes = figure.subplots()
    times_s = 1e-9 * (wide[:, 1] - wide[0, 1])
    periods_ms = 1e3 * np.diff(times_s)
    axes.plot(times_s[1:], periods_ms, ".", color=COLOURS[Role.WIDE], markersize=3)
    axes.set_ylim(0.0, 1.3 * float(periods_ms.max()))
    axes.set_xlabel("time, s")
    axes.set_ylabel("from frame to frame, ms")
    axes.set_title("wide camera at its rate", fontsize=10)
    axes.grid(visible=True, alpha=0.3)
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
