"""A settling report as a file (JSON with format and version) and as a diagram."""

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, SettleReport, StepTrace
from foveacam_pipeline.diagrams import new_figure
from foveacam_pipeline.models.content import plain
from foveacam_pipeline.storage.disk import write_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORMAT = "foveacam-settle"
VERSION = 1
_DPI = 110
_MIN_DRAWN_PX = 0.01
AXIS_COLOURS = {
    ("left", "x"): "#1f77b4",
    ("left", "y"): "#6baed6",
    ("right", "x"): "#d95f02",
    ("right", "y"): "#fdae6b",
}


def save_settle(report: SettleReport, path: Path) -> None:
    """Write a report, replacing an older one."""
    document = {"format": FORMAT, "version": VERSION, "report": plain(report)}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, json.dumps(document, allow_nan=False).encode("utf-8"))


def load_settle(path: Path) -> SettleReport:
    """Read a report; raise InvalidInput when it is unreadable or invalid."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InvalidInput(
            f"settling report {path} cannot be read ({error}); measure how the mirrors settle again"
        ) from error
    if not isinstance(document, dict) or (document.get("format"), document.get("version")) != (
        FORMAT,
        VERSION,
    ):
        raise InvalidInput(f"{path}: not a settling report of version {VERSION}; give another file")
    try:
        return TypeAdapter(SettleReport).validate_json(json.dumps(document.get("report")))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise InvalidInput(
            f"settling report {path}: {where}: {first['msg']}; measure how the mirrors settle again"
        ) from error


def settle_picture(report: SettleReport) -> bytes:
    """Return a PNG of all four axes: with the filter in normal use, logarithmic, and with it wide open."""
    figure = new_figure((11.0, 7.6), dpi=_DPI)
    above, below = figure.subplots(2, 1)
    for found in report.axes:
        _draw_settling(above, found)
        _draw_ringing(below, found)
    above.axhline(report.limit_px, color="0.4", linestyle="--", linewidth=0.8)
    above.set_yscale("log")
    above.set_xlim(0.0, 1.6e-3 * report.settle_us)
    above.set_ylabel("left of the step, fovea px")
    above.set_xlabel("after the command, ms")
    above.set_title(f"drive filter at {report.low_pass_hz} Hz; dashed: {report.limit_px:g} px", fontsize=10)
    below.set_ylabel("left of the step, %")
    below.set_xlabel("after the command, ms")
    below.set_title("drive filter wide open: the mirrors' own swing", fontsize=10)
    for axes in (above, below):
        axes.grid(visible=True, alpha=0.3)
        axes.legend(fontsize=8, loc="upper right")
    figure.suptitle(
        f"{report.rig_id}: at rest to {report.limit_px:g} px after {1e-3 * report.settle_us:.2f} ms"
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _draw_settling(axes: "Axes", found: AxisSettle) -> None:
    label = (
        f"{found.role} {found.axis}: {found.step_px:.0f} px, 1 % after "
        f"{1e-3 * found.settle_share_us:.2f} ms, rest after {1e-3 * found.settle_us:.2f} ms"
    )
    times_ms, left = _trace_arrays(found.trace)
    axes.plot(
        times_ms,
        np.maximum(np.abs(left), _MIN_DRAWN_PX),
        ".-",
        color=_colour(found),
        linewidth=0.8,
        label=label,
    )


def _draw_ringing(axes: "Axes", found: AxisSettle) -> None:
    times_ms, left = _trace_arrays(found.open_trace)
    label = f"{found.role} {found.axis}: {found.ringing}"
    axes.plot(times_ms, 100.0 * left / found.step_px, ".-", color=_colour(found), linewidth=0.8, label=label)


def _trace_arrays(trace: StepTrace) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return 1e-3 * np.array(trace.times_us), np.array(trace.left_px)


def _colour(found: AxisSettle) -> str:
    return AXIS_COLOURS[found.role.value, found.axis]
