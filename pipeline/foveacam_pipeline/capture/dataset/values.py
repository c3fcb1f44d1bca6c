"""The value types of a dataset: points, the frames captured at each, and their records.

A point is one pose of both mirrors. Angles are radians here and in the files, volts differential.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

from foveacam_hardware.contract import Binning, Frame, InvalidInput, Role


class DatasetState(StrEnum):
    """The state of a dataset."""

    RUNNING = "running"
    COMPLETE = "complete"
    PARTIAL = "partial"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shot:
    """One frame of a point: `bracket` numbers exposures, `stack` the frames of one exposure.

    `gaze_rad`: (ax, ay) of the eye during the exposure; computed from the frame's volts when None.
    """

    frame: Frame
    bracket: int = 0
    stack: int = 0
    gaze_rad: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanPosition:
    """The position of a point in its plan. `index` counts points from 0, through all scans.

    `aim_rad`: requested (ax, ay), as seen from the rig's origin; `distance_m`: where both gazes were to meet;
    None, or infinity, where they were to be parallel.
    `rail_m`, `pan_rad`, `tilt_rad`: the rig's own pose; None where there is no such device.
    """

    index: int
    scan: int = 0
    column: int | None = None
    row: int | None = None
    aim_rad: tuple[float, float] | None = None
    distance_m: float | None = None
    rail_m: float | None = None
    pan_rad: float | None = None
    tilt_rad: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CapturedPoint:
    """Everything captured at one point, which is stored completely or not at all.

    A point without shots was skipped, and `skipped` says why.
    """

    place: PlanPosition
    shots: tuple[Shot, ...] = ()
    skipped: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameRecord:
    """The metadata of one frame; `file` is relative to the dataset's folder."""

    role: Role
    bracket: int
    stack: int
    file: str
    sha256: str
    size_bytes: int
    width: int
    height: int
    channels: int
    bits: int
    seq: int
    epoch: int
    t_ns: int
    exposure_ns: int
    volts_v: tuple[float, float] | None
    gaze_rad: tuple[float, float] | None
    binning: Binning = 1
    """Binning of the camera; 1 in datasets from before binning was supported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointRecord:
    """One acknowledged point: its position in the plan, and its frames."""

    place: PlanPosition
    frames: tuple[FrameRecord, ...]
    skipped: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class WriterProgress:
    """The progress of a writer. `acknowledged` points are durably on disk.

    `waited_s`: total time for which `add` waited for the disk; it grows when the rig is faster than the disk.
    """

    planned: int
    acknowledged: int
    queued: int
    written_bytes: int
    waited_s: float


def normalize_point(point: CapturedPoint) -> CapturedPoint:
    """Return a point as it is stored; raise InvalidInput for one that is ambiguous or would lose data."""
    what = f"point {point.place.index}"
    place = point.place
    if place.distance_m == math.inf:
        place = replace(place, distance_m=None)
    _check_finite(
        what, (place.distance_m, place.rail_m, place.pan_rad, place.tilt_rad, *(place.aim_rad or ()))
    )
    if bool(point.shots) == bool(point.skipped):
        raise InvalidInput(f"{what}: give its frames, or say why it is skipped")
    keys = [(shot.frame.role, shot.bracket, shot.stack) for shot in point.shots]
    if len(set(keys)) != len(keys):
        raise InvalidInput(f"{what}: two frames of one camera have the same bracket and stack; number them")
    if any(shot.bracket < 0 or shot.stack < 0 for shot in point.shots):
        raise InvalidInput(f"{what}: brackets and stacks are counted from 0")
    for shot in point.shots:
        _check_shot(what, shot)
    return replace(point, place=place)


def _check_shot(what: str, shot: Shot) -> None:
    frame = shot.frame
    drive = () if frame.volts is None else (frame.volts.x_v, frame.volts.y_v)
    _check_finite(f"{what}, {frame.role.value}", (*drive, *(shot.gaze_rad or ())))
    pixel_bits = frame.image.dtype.itemsize * 8
    if not 1 <= frame.bits <= pixel_bits:
        raise InvalidInput(
            f"{what}: {frame.bits} bits in a frame of {pixel_bits}-bit pixels; pass the frame's true bits"
        )


def _check_finite(what: str, values: Iterable[float | None]) -> None:
    if not all(value is None or math.isfinite(value) for value in values):
        raise InvalidInput(f"{what}: a volt, angle or place is not finite; pass None for what is not known")
