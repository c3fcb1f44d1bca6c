"""Reduction of raw sweeps to the measurements of both eyes: gaze angles of the image centres, rig frame.

The wide camera gives the pose of the target, the fovea's corners the point on it at the image centre. The
parallax (Eq. 1) is corrected with the target's distance (as printed, by tape, or not at all), the drift of
the mounts with the nodes that were visited again.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role, Station
from foveacam_pipeline.calibrate.fit.drift_removal import remove_drift
from foveacam_pipeline.calibrate.fit.measured_rows import (
    DistanceSource,
    FitRow,
    NominalRig,
    PlacedPose,
    eye_rows,
    eye_sweep,
    volts_of,
)
from foveacam_pipeline.calibrate.fit.samples import EyeSweep, MountDrift, RigSweep
from foveacam_pipeline.calibrate.fit.target_poses import TurningBase, constrain_to_base
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose, locate_target
from foveacam_pipeline.calibrate.sweep.sweep import Sweep
from foveacam_pipeline.calibrate.sweep.sweep_checks import (
    EYES,
    check_axes,
    check_eye_seen,
    check_markers,
    check_spread,
    check_sweeps,
    check_target,
)
from foveacam_pipeline.models.intrinsics import Intrinsics

SAME_NODE_RAD = math.radians(0.2)
"""Gazes closer than this were planned as the same, at targets of different distances."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class StationParallax:
    """Parallax between the wide camera and the eyes (Eq. 1) at one station.

    `print_m`: distance by the markers' size, with its scatter over the poses; `tape_m`: that of the station.
    `largest_rad`, `rms_rad`: over both eyes and all poses. `corrected`: the gazes were corrected for it.
    """

    station: str
    print_m: float
    print_scatter_m: float
    tape_m: float | None
    largest_rad: float
    rms_rad: float
    corrected: bool

    @property
    def words(self) -> str:
        """Description in a sentence."""
        tape = "not measured by tape" if self.tape_m is None else f"{self.tape_m:g} m by tape"
        done = "corrected" if self.corrected else "not corrected, as the distance counts as unknown"
        return (
            f"{self.station}: the markers appear {self.print_m:.3f} m away by their print, {tape}; the "
            f"parallax of Eq. 1 is {math.degrees(self.rms_rad):.4f}° rms, at most "
            f"{math.degrees(self.largest_rad):.4f}°; {done}"
        )


def station_parallax(
    station: Station, targets: Sequence[TargetPose], *, baseline_m: float, corrected: bool
) -> StationParallax:
    """Return the parallax at a station: each eye's bearing of its marker minus the wide camera's, exactly."""
    distances = np.array([target.distance_m / target.scale for target in targets])
    missed = np.concatenate([_parallax_rad(target, baseline_m) for target in targets])
    return StationParallax(
        station=station.name,
        print_m=float(np.median(distances)),
        print_scatter_m=float(np.std(distances)),
        tape_m=station.distance_m,
        largest_rad=float(np.abs(missed).max()),
        rms_rad=float(np.sqrt(np.mean(missed**2))),
        corrected=corrected,
    )


def _parallax_rad(target: TargetPose, baseline_m: float) -> NDArray[np.float64]:
    """Return (4,) differences of the angles: left x, y, right x, y."""
    own = np.arctan(target.middle_m[:2] / target.middle_m[2])
    missed = []
    for role, side in ((Role.LEFT, -0.5), (Role.RIGHT, 0.5)):
        seen = target.marker_rig_m(role) - np.array([side * baseline_m, 0.0, 0.0])
        missed.append(np.arctan(seen[:2] / seen[2]) - own)
    return np.concatenate(missed)


__all__ = [
    "DistanceSource",
    "NominalRig",
    "PlacedPose",
    "SweepMeasurements",
    "locate_targets",
    "node_groups",
    "reduce_sweeps",
]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SweepMeasurements:
    """Measurements for the fit, and how they were reduced.

    `nodes`: for each eye (n, 2) int, the sweep's number and the pose's index of every row. `left_out`: poses
    whose target the wide camera could not locate, with the reason. `drift`: of each eye's mount, removed from
    every row; None when it was not measured or not removed.
    """

    rig: RigSweep
    parallax: tuple[StationParallax, ...]
    base: TurningBase
    nodes: dict[Role, NDArray[np.int64]]
    left_out: tuple[str, ...]
    drift: dict[Role, MountDrift] | None = None


def reduce_sweeps(
    sweeps: Sequence[Sweep],
    wide: Intrinsics,
    *,
    drawing: NominalRig,
    label: str,
    distance: DistanceSource = DistanceSource.PRINT,
    take_out_drift: bool = True,
) -> SweepMeasurements:
    """Return the measurements of both eyes in the sweeps; raise InvalidInput naming what is wrong with them.

    Further visits to a node serve to measure the mounts' drift and are not rows of the result.
    """
    check_sweeps(sweeps, wide, rig_id=drawing.rig_id)
    placed, left_out, base = locate_targets(sweeps, wide, distance=distance)
    centre_px = (np.array(sweeps[0].header.fovea_size) - 1) / 2.0
    seen = {role: eye_rows(placed, role, drawing, distance, centre_px=centre_px) for role in EYES}
    group = dict(zip(((p.sweep, p.pose.index) for p in placed), node_groups(placed), strict=True))
    _check_nodes(sweeps, seen)
    straight, drift = remove_drift(seen, group, f_px=drawing.fovea_f_px) if take_out_drift else (seen, None)
    rows = {role: [row for row in straight[role] if not row.visit] for role in EYES}
    one_depth = distance is DistanceSource.UNKNOWN
    header = sweeps[0].header
    rig = RigSweep(
        rig_id=drawing.rig_id,
        created_utc=max(sweep.header.created_utc for sweep in sweeps),
        origin="measured",
        label=label,
        wide=wide,
        left=_sweep_of_eye(rows, Role.LEFT, group, drift, one_depth=one_depth),
        right=_sweep_of_eye(rows, Role.RIGHT, group, drift, one_depth=one_depth),
        baseline_m=drawing.baseline_m,
        fovea_f_px=drawing.fovea_f_px,
        fovea_width=header.fovea_size[0],
        fovea_height=header.fovea_size[1],
        pupil_m=drawing.pupil_m,
    )
    return SweepMeasurements(
        rig=rig,
        parallax=_parallax(sweeps, placed, drawing, distance),
        base=base,
        nodes={role: np.array([row.node for row in rows[role]], dtype=np.int64) for role in EYES},
        left_out=left_out,
        drift=drift,
    )


def _check_nodes(sweeps: Sequence[Sweep], seen: dict[Role, list[FitRow]]) -> None:
    """Raise InvalidInput for an eye without measurements, a dead axis, or poses on a line."""
    max_v = max(sweep.header.max_v for sweep in sweeps)
    for role in EYES:
        nodes = [row for row in seen[role] if not row.visit]
        volts, angles = volts_of(nodes), np.array([row.angles_rad for row in nodes]).reshape(-1, 2)
        check_axes(volts, angles, role=role, max_v=max_v)
        check_eye_seen(sweeps, role, accepted=len(nodes))
        check_spread(volts, role=role)


def _parallax(
    sweeps: Sequence[Sweep], placed: Sequence[PlacedPose], drawing: NominalRig, distance: DistanceSource
) -> tuple[StationParallax, ...]:
    return tuple(
        station_parallax(
            sweep.header.station,
            [one.target for one in placed if one.sweep == k],
            baseline_m=drawing.baseline_m,
            corrected=distance is not DistanceSource.UNKNOWN,
        )
        for k, sweep in enumerate(sweeps)
    )


def _sweep_of_eye(
    rows: dict[Role, list[FitRow]],
    role: Role,
    group: dict[tuple[int, int], int],
    drift: dict[Role, MountDrift] | None,
    *,
    one_depth: bool,
) -> EyeSweep:
    eye = eye_sweep(rows[role], group, one_depth=one_depth)
    return replace(eye, drift=None if drift is None else drift[role])


def locate_targets(
    sweeps: Sequence[Sweep], wide: Intrinsics, *, distance: DistanceSource
) -> tuple[list[PlacedPose], tuple[str, ...], TurningBase]:
    """Return every pose with its target's pose, those without and the reasons, and the axes of the base."""
    placed: list[list[PlacedPose]] = []
    left_out: list[str] = []
    for k, sweep in enumerate(sweeps):
        check_markers(sweep)
        mine = []
        for pose in (*sweep.poses, *sweep.repeats):
            try:
                target = locate_target(pose.wide, sweep.header.layout, wide)
            except InvalidInput as error:
                left_out.append(f"{sweep.header.station.name}, pose {pose.index}: {error}")
                continue
            mine.append(PlacedPose(sweep=k, pose=pose, target=target))
        if 2 * len(mine) < len(sweep.poses) or not mine:
            raise InvalidInput(
                f"sweep at {sweep.header.station.name!r}: the target was placed at {len(mine)} of "
                f"{len(sweep.poses)} poses only; {left_out[-1] if left_out else 'it holds no pose'}"
            )
        placed.append(mine)
    targets, base = constrain_to_base(
        [[p.target for p in mine] for mine in placed], [[p.pose.wide for p in mine] for mine in placed], wide
    )
    for sweep, found in zip(sweeps, targets, strict=True):
        check_target(sweep, found)
    held = [
        PlacedPose(
            sweep=p.sweep, pose=p.pose, target=_at_stated_distance(target, sweeps[p.sweep], distance, found)
        )
        for mine, found in zip(placed, targets, strict=True)
        for p, target in zip(mine, found, strict=True)
    ]
    return held, tuple(left_out), base


def _at_stated_distance(
    target: TargetPose, sweep: Sweep, distance: DistanceSource, station: Sequence[TargetPose]
) -> TargetPose:
    """Return the target at the distance of `distance`; a tape scales all poses of its station alike."""
    if distance is not DistanceSource.TAPE:
        return target
    tape_m = sweep.header.station.distance_m
    if tape_m is None:
        raise InvalidInput(
            f"fit by tape: the distance of {sweep.header.station.name!r} was not measured; measure it and "
            "write it into the station, or let the print decide"
        )
    factor = tape_m / float(np.median([pose.distance_m for pose in station]))
    return target.at_distance(factor * target.distance_m)


def node_groups(placed: Sequence[PlacedPose]) -> list[int]:
    """Return for each pose the number of the first pose that was planned for nearly the same gaze."""
    nodes_rad = np.array([one.pose.node_rad for one in placed])
    apart = np.linalg.norm(nodes_rad[:, None, :] - nodes_rad[None, :, :], axis=2)
    return [int(first) for first in np.argmax(apart < SAME_NODE_RAD, axis=1)]
