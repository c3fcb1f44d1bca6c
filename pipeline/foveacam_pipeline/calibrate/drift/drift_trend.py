"""The trend of drift over time: how far each eye has moved since its rig was calibrated, all told."""

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.drift_history import DriftRecord
from foveacam_pipeline.verge.aim import EYES

_DPI = 110
ROWS = ("across, °", "down, °", "roll, °")
UNITS = (("days", 86_400.0), ("hours", 3_600.0), ("minutes", 60.0))
COLOURS = {Role.LEFT: "#1f77b4", Role.RIGHT: "#d95f02"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftTrend:
    """n checks: `moved_rad` and `sigma_rad` are (n, 3) across, down and roll of each eye, since calibrated.

    What corrections have taken out is put back in: the trend is the mount's, whatever calibration was used.
    """

    records: tuple[DriftRecord, ...]
    moved_rad: dict[Role, NDArray[np.float64]]
    sigma_rad: dict[Role, NDArray[np.float64]]


def drift_trend(records: Sequence[DriftRecord]) -> DriftTrend:
    """Return the trend of checks with lock, oldest first."""
    kept = tuple(sorted((r for r in records if r.check.locked), key=lambda record: record.created))
    known: dict[str, dict[Role, NDArray[np.float64]]] = {}
    moved: dict[Role, list[NDArray[np.float64]]] = {role: [] for role in EYES}
    sigma: dict[Role, list[NDArray[np.float64]]] = {role: [] for role in EYES}
    for record in kept:
        before = known.get(record.check.calibration_id, {role: np.zeros(3) for role in EYES})
        now = {}
        for role in EYES:
            eye = record.check.eye(role)
            now[role] = before[role] + np.array([*eye.turn.shift_rad, eye.turn.turn_rad[2]])
            moved[role].append(now[role])
            sigma[role].append(np.array([*eye.shift_sigma_rad, eye.roll_sigma_rad]))
        if record.new_calibration_id is not None:
            known[record.new_calibration_id] = now
    return DriftTrend(
        records=kept,
        moved_rad={role: np.array(moved[role]).reshape(-1, 3) for role in EYES},
        sigma_rad={role: np.array(sigma[role]).reshape(-1, 3) for role in EYES},
    )


def trend_picture(records: Sequence[DriftRecord]) -> bytes:
    """Return a PNG of the trend; filled dots are checks that were applied."""
    trend = drift_trend(records)
    figure = Figure(figsize=(10.0, 7.0), dpi=_DPI, layout="constrained")
    rows = figure.subplots(3, 1, sharex=True)
    for row, (axes, label) in enumerate(zip(rows, ROWS, strict=True)):
        for role in EYES:
            _line(axes, trend, role, row=row)
        axes.set_ylabel(label)
        axes.grid(visible=True, alpha=0.3)
    rows[0].legend(fontsize=9)
    unit, _ = _unit(trend)
    rows[-1].set_xlabel(f"{unit} since {trend.records[0].created:%Y-%m-%d %H:%M}" if trend.records else unit)
    figure.suptitle(f"{_counted(len(trend.records))}: where the eyes have gone since they were calibrated")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _counted(checks: int) -> str:
    return "1 drift check" if checks == 1 else f"{checks} drift checks"


def _line(axes: Axes, trend: DriftTrend, role: Role, *, row: int) -> None:
    _, per_s = _unit(trend)
    times = _elapsed_s(trend) / per_s
    moved_deg = np.rad2deg(trend.moved_rad[role][:, row])
    sigma_deg = np.rad2deg(trend.sigma_rad[role][:, row])
    colour = COLOURS[role]
    axes.plot(times, moved_deg, "-", color=colour, linewidth=0.8, label=f"{role} eye")
    for time, moved, sigma, record in zip(times.tolist(), moved_deg, sigma_deg, trend.records, strict=True):
        fill = colour if record.applied else "white"
        axes.errorbar(time, moved, yerr=sigma, fmt="o", color=colour, markerfacecolor=fill, markersize=5)


def _elapsed_s(trend: DriftTrend) -> NDArray[np.float64]:
    """Return (n,) seconds since the first check."""
    first = [record.created for record in trend.records[:1]]
    return np.array([(record.created - first[0]).total_seconds() for record in trend.records])


def _unit(trend: DriftTrend) -> tuple[str, float]:
    """Return the unit of the time axis and its length, s."""
    span_s = float(_elapsed_s(trend)[-1]) if trend.records else 0.0
    return next((name, length) for name, length in UNITS if span_s >= length or length == UNITS[-1][1])
