"""The rail positions of a dataset's scans, and whether a depth reference can be computed from them.

Only the dataset's records are read, no image. The reference itself is computed by `capture.reference`.
"""

from dataclasses import dataclass

import numpy as np

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.models.calibration import Calibration

EYES = (Role.LEFT, Role.RIGHT)
SMALLEST_SPACING_M = 0.01
"""Minimum distance of two scans that count as taken from different positions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RailStop:
    """The rail position of one scan; `along_m`: relative to the judged scan, as reported by the rail."""

    scan: int
    rail_m: float
    along_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceBasis:
    """The inputs of a reference.

    `judged`: index of the stop whose depth is judged; `pairs`: how many it has.
    """

    calibration: Calibration
    stops: tuple[RailStop, ...]
    judged: int
    pairs: int


def reference_basis(dataset: Dataset, *, scan: int | None = None, bracket: int = 0) -> ReferenceBasis:
    """Return what a reference is computed from; `scan` None judges the scan nearest to the middle.

    Raise NotCalibrated or InvalidInput where no reference can be computed.
    """
    calibration = rail_calibration(dataset)
    stops, judged = rail_stops(dataset, scan)
    chosen = stops[judged].scan
    pairs = sum(_has_pair(point, bracket) for point in dataset.scan(chosen))
    if not pairs:
        raise InvalidInput(
            f"{dataset.folder}, scan {chosen} has no pair of bracket {bracket} with the volts of its mirrors;"
            " choose another scan or bracket"
        )
    return ReferenceBasis(calibration=calibration, stops=stops, judged=judged, pairs=pairs)


def rail_calibration(dataset: Dataset) -> Calibration:
    """Return the dataset's calibration. Raise NotCalibrated, or InvalidInput for several bearings."""
    if dataset.calibration is None:
        raise NotCalibrated(
            f"{dataset.folder} has no calibration: where its views look is not known; capture with one"
        )
    bearings = {(point.place.pan_rad, point.place.tilt_rad) for point in dataset}
    if len(bearings) > 1:
        raise InvalidInput(
            f"{dataset.folder} was taken from {len(bearings)} bearings of the pan-tilt, whose axes are not "
            "calibrated; a reference needs scans that differ by the rail alone"
        )
    return dataset.calibration


def rail_positions_m(dataset: Dataset) -> dict[int, float]:
    """Return the rail position of every scan whose position is known, m."""
    positions = {number: _rail_m(dataset, number) for number in dataset.scans}
    return {number: rail_m for number, rail_m in positions.items() if rail_m is not None}


def rail_stops(dataset: Dataset, scan: int | None = None) -> tuple[tuple[RailStop, ...], int]:
    """Return the rail stops and the index of the judged one; raise InvalidInput for a single position."""
    known = rail_positions_m(dataset)
    spread_m = max(known.values(), default=0.0) - min(known.values(), default=0.0)
    if spread_m < SMALLEST_SPACING_M:
        raise InvalidInput(
            f"{dataset.folder}: a reference was asked for, which needs scans from two places on the rail or "
            f"more; {_found(known)}",
            asked="scans from two places on the rail or more",
            found=_found(known),
            remedy="capture with several rail positions",
        )
    chosen = scan
    if chosen is None:
        middle_m = (max(known.values()) + min(known.values())) / 2.0
        chosen = min(known, key=lambda number: abs(known[number] - middle_m))
    if chosen not in known:
        raise InvalidInput(
            f"{dataset.folder} has no scan {chosen} on the rail; its scans are {sorted(known)}"
        )
    stops = tuple(
        RailStop(scan=number, rail_m=rail_m, along_m=rail_m - known[chosen])
        for number, rail_m in known.items()
    )
    return stops, list(known).index(chosen)


def _has_pair(point: DatasetPoint, bracket: int) -> bool:
    roles = {frame.role for frame in point.frames if frame.bracket == bracket}
    return point.pose.volts is not None and roles.issuperset(EYES)


def _rail_m(dataset: Dataset, scan: int) -> float | None:
    """Return the rail position of a scan, m; None where it is unknown or not the same at all points."""
    reported = [point.place.rail_m for point in dataset.scan(scan)]
    known = [rail_m for rail_m in reported if rail_m is not None]
    if not known or len(known) < len(reported) or max(known) - min(known) > SMALLEST_SPACING_M / 10.0:
        return None
    return float(np.median(known))


def _found(known: dict[int, float]) -> str:
    if not known:
        return "it does not say where on a rail any scan was taken"
    places = ", ".join(f"{1e3 * rail_m:g} mm" for rail_m in sorted(set(known.values())))
    return f"it has {len(known)} scan{'s' if len(known) > 1 else ''} from {places}"
