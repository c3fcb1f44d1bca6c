"""What a sweep must be like before anything is fitted to it: one rig, markers where they belong, live axes.

Every refusal names what was found and what to do; nothing is repaired in silence.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, NotCalibrated, Role
from foveacam_pipeline.calibrate.sweep import Sweep
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.models.mirror import DAC_STEP_V

EYES = (Role.LEFT, Role.RIGHT)
FEWEST_POSES = 30
"""Three poses for each of the ten coefficients of the paper's cubic."""
LARGEST_MISS_PX = 0.6
"""Wide px of a corner over all poses; a tenth of it is usual, a millimetre of spacing at 5 m is 0.6."""
LARGEST_TAPE_ERROR = 0.05
_LEAST_SPAN_V = 20.0
_THINNEST = 0.15
"""Share of the longer axis of a cloud of poses, or of the livelier axis of a mirror."""


class EyeSamples(Protocol):
    """What is asked of the measurements of one eye."""

    @property
    def volts_v(self) -> NDArray[np.float64]:
        """(n, 2) drive."""
        ...

    @property
    def angles_rad(self) -> NDArray[np.float64]:
        """(n, 2) gaze."""
        ...


def check_sweeps(sweeps: Sequence[Sweep], wide: Intrinsics, *, rig_id: str) -> None:
    """Raise unless the sweeps are of this rig and these cameras, each of another station."""
    if not sweeps:
        raise InvalidInput("fit: no sweep was given; run the mirrors' stage at a station with markers first")
    first = sweeps[0].header
    for sweep in sweeps:
        header = sweep.header
        if header.rig_id != rig_id:
            raise NotCalibrated(
                f"sweep at {header.station.name!r} was made on rig {header.rig_id!r}, this rig is {rig_id!r}; "
                "give this rig's sweeps"
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
    """Raise when an eye looked at a marker that is not its own, or when the markers hang in another order."""
    layout, station = sweep.header.layout, sweep.header.station.name
    for role in EYES:
        strangers = Counter(
            eye.corners.id for pose in sweep.poses if (eye := pose.eye(role)) and _stranger(eye.corners.id, layout.id_of(role))
        )
        if strangers:
            marker, count = strangers.most_common(1)[0]
            owner = layout.role_of(marker)
            raise InvalidInput(
                f"sweep at {station!r}: in {count} poses the {role} eye was centred on marker {marker}, which is "
                f"{f'the {owner} camera' if owner else 'nobody'}'s, instead of {layout.id_of(role)}; "
                "swap the markers or correct the ids, and sweep again"
            )
    turned = sum(_left_of_right(pose.wide, layout.left_id, layout.right_id) is False for pose in sweep.poses)
    if 2 * turned > len(sweep.poses):
        raise InvalidInput(
            f"sweep at {station!r}: in {turned} of {len(sweep.poses)} poses the wide camera sees the left eye's "
            "marker to the right of the right eye's; they are swapped or hang upside down: hang them as laid "
            "out, and sweep again"
        )


def check_target(sweep: Sweep, *, miss_px: float, distance_m: float) -> None:
    """Raise when the target is not built as the layout says: corners that miss, or a size off the tape's."""
    layout, station = sweep.header.layout, sweep.header.station
    said = f"side {1e3 * layout.side_m:g} mm, spacing {1e3 * layout.spacing_m:g} mm"
    if miss_px > LARGEST_MISS_PX:
        raise InvalidInput(
            f"sweep at {station.name!r}: the corners miss the target as laid out ({said}) by {miss_px:.2f} wide "
            f"px, up to {LARGEST_MISS_PX:g} is usual; measure side and spacing on the print and hang the "
            "markers in one plane"
        )
    if station.distance_m is not None and abs(distance_m / station.distance_m - 1.0) > LARGEST_TAPE_ERROR:
        raise InvalidInput(
            f"sweep at {station.name!r}: markers of {said} appear {distance_m:.3f} m away, the station says "
            f"{station.distance_m:g} m; measure the print and the distance again: one of them is of a wrong size"
        )


def check_eye_seen(sweeps: Sequence[Sweep], role: Role) -> None:
    """Raise when an eye has too few poses, with the reason that was given most often."""
    poses = sum(len(sweep.poses) for sweep in sweeps)
    accepted = sum(len(sweep.accepted(role)) for sweep in sweeps)
    if accepted >= FEWEST_POSES:
        return
    reasons = Counter(reason for sweep in sweeps for pose in sweep.poses if (reason := pose.refusal(role)))
    why = "; ".join(f"{reason} ({count} times)" for reason, count in reasons.most_common(2))
    hidden = "its marker was hidden from it throughout" if accepted == 0 else "that is too few for a cubic"
    raise InvalidInput(
        f"{role} eye: measured at {accepted} of {poses} poses, {hidden}; at least {FEWEST_POSES} are needed"
        + (f" ({why})" if why else "")
        + "; see what hides the marker, and resume the sweep"
    )


def check_eye(eye: EyeSamples, role: Role, *, max_v: float) -> None:
    """Raise when an eye's poses lie along a line, beyond the volts, or one axis of its mirror does nothing."""
    volts = eye.volts_v
    if (np.abs(volts) > max_v + 2.0 * DAC_STEP_V).any():
        raise InvalidInput(
            f"{role} eye: the sweep holds {float(np.abs(volts).max()):.1f} V, beyond the mirrors' ±{max_v:g} V; "
            "it is not this rig's, or was changed; sweep again"
        )
    dead = _dead_axis(volts, eye.angles_rad)
    if dead is not None:
        raise InvalidInput(
            f"{role} eye: the {dead} axis of its mirror does not follow its volts (it is dead or unplugged); "
            "check the mirror and its cable, then sweep again"
        )
    spread = np.linalg.svd(volts - volts.mean(axis=0), compute_uv=False)
    if np.ptp(volts, axis=0).min() < _LEAST_SPAN_V or spread[1] < _THINNEST * spread[0]:
        span = np.ptp(volts, axis=0)
        raise InvalidInput(
            f"{role} eye: its poses span {span[0]:.0f} V by {span[1]:.0f} V and lie nearly on a line; sweep a "
            "grid in both directions"
        )


def _dead_axis(volts_v: NDArray[np.float64], angles_rad: NDArray[np.float64]) -> str | None:
    """Return the axis along which the gaze does not follow the volts, though these were driven."""
    driven = np.column_stack([np.ones(len(volts_v)), volts_v])
    slopes = np.linalg.lstsq(driven, angles_rad, rcond=None)[0][1:]
    moved = np.abs(np.diag(slopes)) * np.ptp(volts_v, axis=0)
    span = np.ptp(volts_v, axis=0)
    for axis, name in enumerate("xy"):
        idle = np.abs(slopes[axis, axis]) < _THINNEST * np.abs(slopes[1 - axis, 1 - axis])
        if idle and span[axis] >= _LEAST_SPAN_V and moved[axis] < _THINNEST * moved[1 - axis]:
            return name
    return None


def _stranger(found: int, own: int) -> bool:
    return found != own


def _left_of_right(wide: dict[int, object], left_id: int, right_id: int) -> bool | None:
    """Return whether the left marker stands left of the right one; None when one is missing."""
    if left_id not in wide or right_id not in wide:
        return None
    places = [np.mean(getattr(wide[marker], "corners_px")[:, 0]) for marker in (left_id, right_id)]
    return bool(places[0] < places[1])


def _size(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]} px"
