"""Checks of sweeps before a fit: one rig and its cameras, the right markers, responding mirror axes.

Every refusal names what was found and what to do; nothing is repaired silently.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role
from foveacam_pipeline.calibrate.sweep.marker_target import TAPE_TOLERANCE, TargetPose, check_order
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.models.mirror import DAC_STEP_V

EYES = (Role.LEFT, Role.RIGHT)
MIN_POSES = 30
"""Three poses for each of the ten coefficients of the paper's cubic."""
_FEWEST_FOR_AXES = 5
_LEAST_SPAN_V = 20.0
_THINNEST = 0.15
"""Minimum ratio of the shorter to the longer axis of the poses, and of the two gains of a mirror."""


def check_sweeps(sweeps: Sequence[Sweep], wide: Intrinsics, *, rig_id: str) -> None:
    """Raise unless the sweeps are of this rig and these cameras, each of another station."""
    if not sweeps:
        raise InvalidInput("fit: no sweep was given; run the mirrors' stage at a station with markers first")
    first = sweeps[0].header
    for sweep in sweeps:
        header = sweep.header
        if header.rig_id != rig_id:
            raise NotCalibrated(
                f"sweep at {header.station.name!r} was made on rig {header.rig_id!r}, this is "
                f"{rig_id!r}; give this rig's sweeps"
            )
        if header.wide_size != (wide.width, wide.height):
            raise InvalidInput(
                f"sweep at {header.station.name!r}: its wide images are {_size(header.wide_size)}, the wide "
                f"camera was calibrated at {_size((wide.width, wide.height))}; "
                "calibrate the camera that made the sweep"
            )
        serials = header.wide_serial, header.left_serial, header.right_serial
        if (serials, header.fovea_size) != (
            (first.wide_serial, first.left_serial, first.right_serial),
            first.fovea_size,
        ):
            raise InvalidInput(
                f"sweep at {header.station.name!r}: its cameras {serials} are not those of the sweep at "
                f"{first.station.name!r}; fit sweeps of the same cameras together"
            )
    names = Counter(sweep.header.station.name for sweep in sweeps)
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise InvalidInput(f"fit: the sweep at {twice[0]!r} was given twice; give each station's sweep once")


def check_markers(sweep: Sweep) -> None:
    """Raise when an eye measured a marker that is not its own, or when the markers are in another order."""
    layout, station = sweep.header.layout, sweep.header.station.name
    for role in EYES:
        own = layout.id_of(role)
        seen = Counter(eye.corners.id for pose in sweep.poses if (eye := pose.eye(role)) is not None)
        strangers = [(count, marker) for marker, count in seen.items() if marker != own]
        if strangers:
            count, marker = max(strangers)
            owner = layout.role_of(marker)
            whose = f"the {owner} camera's" if owner else "nobody's"
            raise InvalidInput(
                f"sweep at {station!r}: in {count} poses the {role} eye looked at marker {marker}, which is "
                f"{whose}, instead of {own}; swap the markers or correct the ids, and sweep again"
            )
    turned = 0
    for pose in sweep.poses:
        try:
            check_order(pose.wide, layout)
        except InvalidInput as error:
            turned, reason = turned + 1, error
    if turned and 2 * turned > len(sweep.poses):
        raise InvalidInput(f"sweep at {station!r}, {turned} of {len(sweep.poses)} poses: {reason}")


def check_target(sweep: Sweep, poses: Sequence[TargetPose]) -> None:
    """Raise when the target's distance differs from its station's: print or tape is wrong."""
    layout, station = sweep.header.layout, sweep.header.station
    if station.distance_m is None:
        return
    distance_m = float(np.median([pose.distance_m for pose in poses]))
    if abs(distance_m / station.distance_m - 1.0) > TAPE_TOLERANCE:
        raise InvalidInput(
            f"sweep at {station.name!r}: markers of {1e3 * layout.side_m:g} mm, "
            f"{1e3 * layout.spacing_m:g} mm apart, appear {distance_m:.3f} m away, the station says "
            f"{station.distance_m:g} m; measure the print and the distance again: one of them is wrong"
        )


def check_eye_seen(sweeps: Sequence[Sweep], role: Role, *, accepted: int) -> None:
    """Raise when an eye has too few poses, with the most frequent reasons."""
    if accepted >= MIN_POSES:
        return
    poses = sum(len(sweep.poses) for sweep in sweeps)
    reasons = Counter(reason for sweep in sweeps for pose in sweep.poses if (reason := pose.refusal(role)))
    why = "; ".join(f"{reason} ({count} times)" for reason, count in reasons.most_common(2))
    hidden = "its marker was hidden from it throughout" if accepted == 0 else "too few for a cubic"
    raise InvalidInput(
        f"{role} eye: measured at {accepted} of {poses} poses, {hidden}; at least {MIN_POSES} are needed"
        + (f" ({why})" if why else "")
        + "; see to the reason, and resume the sweep"
    )


def check_axes(
    volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64], *, role: Role, max_v: float
) -> None:
    """Raise when (n, 2) volts lie beyond the limits, or one axis of the mirror does not follow them."""
    if len(volts_v) and float(np.abs(volts_v).max()) > max_v + 2.0 * DAC_STEP_V:
        raise InvalidInput(
            f"{role} eye: the sweep holds {float(np.abs(volts_v).max()):.1f} V, beyond the mirrors' "
            f"±{max_v:g} V; it is not this rig's, or was changed; sweep again"
        )
    dead = _dead_axis(volts_v, angles_rad) if len(volts_v) >= _FEWEST_FOR_AXES else None
    if dead is not None:
        raise InvalidInput(
            f"{role} eye: the {dead} axis of its mirror does not follow its volts (dead or unplugged); check "
            "the mirror and its cable, then sweep again"
        )


def check_spread(volts_v: NDArray[np.float64], *, role: Role) -> None:
    """Raise when the poses of an eye lie nearly on a line: nothing can be fitted across it."""
    span = np.ptp(volts_v, axis=0)
    spread = np.linalg.svd(volts_v - volts_v.mean(axis=0), compute_uv=False)
    if span.min() < _LEAST_SPAN_V or spread[1] < _THINNEST * spread[0]:
        raise InvalidInput(
            f"{role} eye: its poses span {span[0]:.0f} V by {span[1]:.0f} V and lie nearly on a line; "
            "sweep a grid in both directions"
        )


def _dead_axis(volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64]) -> str | None:
    """Return the axis along which the gaze does not follow the driven volts, None when both follow."""
    driven = np.column_stack([np.ones(len(volts_v)), volts_v])
    slopes = np.abs(np.diag(np.linalg.lstsq(driven, angles_rad, rcond=None)[0][1:]))
    span = np.ptp(volts_v, axis=0)
    for axis, name in enumerate("xy"):
        if span[axis] >= _LEAST_SPAN_V and slopes[axis] < _THINNEST * slopes[1 - axis]:
            return name
    return None


def _size(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]} px"
