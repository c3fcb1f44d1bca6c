"""History of the drift checks of a rig, one JSON line a check, and the trend of drift over time."""

import io
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.drift.values import DriftCheck
from foveacam_pipeline.diagrams import new_figure
from foveacam_pipeline.models.content import content_id, plain
from foveacam_pipeline.verge.aim import EYES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FILE = "drift.jsonl"
FORMAT = "foveacam-drift-check"
VERSION = 1
_DPI = 110
TREND_LABELS = ("across, °", "down, °", "roll, °")
TIME_UNITS = (("days", 86_400.0), ("hours", 3_600.0), ("minutes", 60.0))
EYE_COLOURS = {Role.LEFT: "#1f77b4", Role.RIGHT: "#d95f02"}


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftRecord:
    """One stored check. `created_utc`: ISO 8601. `new_calibration_id`: the corrected one, if any."""

    id: str
    created_utc: str
    check: DriftCheck
    new_calibration_id: str | None = None

    @property
    def applied(self) -> bool:
        """Whether a calibration was corrected by it."""
        return self.new_calibration_id is not None

    @property
    def created(self) -> datetime:
        """Time of the check, with its time zone."""
        return datetime.fromisoformat(self.created_utc)


class DriftHistory:
    """All checks of one rig's data folder."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE

    def add(
        self, check: DriftCheck, *, created_utc: str, new_calibration_id: str | None = None
    ) -> DriftRecord:
        """Append a check to the file."""
        content = plain(check)
        record = DriftRecord(
            id=content_id([created_utc, content]),
            created_utc=created_utc,
            check=check,
            new_calibration_id=new_calibration_id,
        )
        line = {
            "format": FORMAT,
            "version": VERSION,
            "id": record.id,
            "created_utc": created_utc,
            "new_calibration_id": new_calibration_id,
            "check": content,
        }
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("ab+") as file:
            if file.tell() and not _ends_with_newline(file):
                file.write(b"\n")  # after a truncated line
            file.write(json.dumps(line, allow_nan=False).encode("utf-8") + b"\n")
            file.flush()
            os.fsync(file.fileno())
        return record

    def records(self) -> list[DriftRecord]:
        """Return all checks, oldest first; a truncated line is left out.

        Raise InvalidInput where the file cannot be read.
        """
        if not self._path.exists():
            return []
        try:
            text = self._path.read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            raise InvalidInput(
                f"{self._path} cannot be read: {error.strerror}",
                asked="the history of drift checks",
                found=f"{self._path}: {error.strerror}",
                remedy="restore the file or move it away",
            ) from error
        lines = enumerate(text.splitlines(), start=1)
        found = (self._parsed(line, number) for number, line in lines if line)
        return [record for record in found if record is not None]

    def _parsed(self, line: str, number: int) -> DriftRecord | None:
        """Return the check of a line; None when writing it was interrupted."""
        try:
            document = json.loads(line)
        except json.JSONDecodeError:
            return None
        try:
            if (document["format"], document["version"]) != (FORMAT, VERSION):
                raise ValueError(f"not of version {VERSION}")
            return DriftRecord(
                id=document["id"],
                created_utc=document["created_utc"],
                check=TypeAdapter(DriftCheck).validate_json(json.dumps(document["check"])),
                new_calibration_id=document["new_calibration_id"],
            )
        except (ValueError, KeyError, TypeError) as error:
            raise InvalidInput(
                f"{self._path}, line {number}: not a drift check that can be read ({type(error).__name__}); "
                "restore the file or move it away"
            ) from error


def _ends_with_newline(file: BinaryIO) -> bool:
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriftTrend:
    """n checks: `moved_rad` and `sigma_rad` are (n, 3) across, down and roll of each eye, since calibrated.

    Earlier corrections are added back: the trend is that of the mount, whatever calibration was used.
    """

    records: tuple[DriftRecord, ...]
    moved_rad: dict[Role, NDArray[np.float64]]
    sigma_rad: dict[Role, NDArray[np.float64]]


def drift_trend(records: Sequence[DriftRecord]) -> DriftTrend:
    """Return the trend of checks with lock, oldest first."""
    locked = tuple(sorted((r for r in records if r.check.locked), key=lambda record: record.created))
    known: dict[str, dict[Role, NDArray[np.float64]]] = {}
    moved: dict[Role, list[NDArray[np.float64]]] = {role: [] for role in EYES}
    sigma: dict[Role, list[NDArray[np.float64]]] = {role: [] for role in EYES}
    for record in locked:
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
        records=locked,
        moved_rad={role: np.array(moved[role]).reshape(-1, 3) for role in EYES},
        sigma_rad={role: np.array(sigma[role]).reshape(-1, 3) for role in EYES},
    )


def trend_picture(records: Sequence[DriftRecord]) -> bytes:
    """Return a PNG of the trend; filled dots are checks that were applied."""
    trend = drift_trend(records)
    figure = new_figure((10.0, 7.0), dpi=_DPI)
    rows = figure.subplots(3, 1, sharex=True)
    for row, (axes, label) in enumerate(zip(rows, TREND_LABELS, strict=True)):
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


def _line(axes: "Axes", trend: DriftTrend, role: Role, *, row: int) -> None:
    _, per_s = _unit(trend)
    times = _elapsed_s(trend) / per_s
    moved_deg = np.rad2deg(trend.moved_rad[role][:, row])
    sigma_deg = np.rad2deg(trend.sigma_rad[role][:, row])
    colour = EYE_COLOURS[role]
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
    return next(
        (name, length) for name, length in TIME_UNITS if span_s >= length or length == TIME_UNITS[-1][1]
    )
