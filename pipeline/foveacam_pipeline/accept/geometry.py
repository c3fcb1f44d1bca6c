"""Check of the geometry at markers of known size and distance: the calibration, the baseline, print and tape.

At each station both eyes look at the wide camera's marker. Three lengths are compared: the distance by tape,
by the size of the printed markers in the wide picture, and by the two gazes. An eye that has moved is wrong
by one angle at every distance; a wrong baseline by an angle in proportion to 1/Z; a wrong print shows in the
wide picture alone; a wrong tape in both others alike.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import DeviceFault, Role, Sighting, Station
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import EYES, REST, RigUnderTest, frame_of, shades_of
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose, locate_target
from foveacam_pipeline.calibrate.sweep.markers import find_markers, middle_px
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.geometry.triangulate import depth_sigma_m
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import plane_from_raw

TITLE = "Geometry: distances by tape, by print and by the two gazes"
POSE_SIGMAS = 4.0
SIGMAS = 3.0
LOOKS = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StationMeasure:
    """What one station shows. Lengths in metres, along z; `taped_m`: None where it was not taped.

    `errors_px` (2, 2): measured minus calibrated place of the marker for the left and the right eye, (x, y)
    px of the virtual planes.
    """

    name: str
    taped_m: float | None
    printed_m: float
    stereo_m: float
    stereo_sigma_m: float
    z_m: float
    errors_px: NDArray[np.float64]

    @property
    def stereo_rel(self) -> float:
        """Relative difference of the distance by the gazes from that by tape (else by print)."""
        return self.stereo_m / self.z_m - 1.0

    @property
    def printed_rel(self) -> float:
        """Relative difference of the distance by print from that by tape; 0 without a tape."""
        return 0.0 if self.taped_m is None else self.printed_m / self.taped_m - 1.0


def check_geometry(
    rig: RigUnderTest,
    limits: AcceptanceLimits,
    calibration: Calibration,
    *,
    stations: Sequence[Station],
    turn: Callable[[Station], None],
) -> tuple[AcceptanceCheck, tuple[StationMeasure, ...]]:
    """Return the result at all stations with markers; the rig stays turned to the last."""
    measures = []
    for station in stations:
        turn(station)
        measures.append(_measure(rig, station, calibration))
    findings = named(measures, limits, calibration)
    figures = [
        figure for one in measures for figure in _figures(one, limits, _allowed_px(one, limits, calibration))
    ]
    return judged("geometry", TITLE, figures=figures, findings=findings, picture="distances"), tuple(measures)


def _figures(one: StationMeasure, limits: AcceptanceLimits, allowed_px: float) -> list[Measured]:
    allowed = _allowed_m(one, limits)
    found = [
        Measured(
            name=f"{one.name}: distance by the gazes",
            value=round(one.stereo_m, 4),
            unit="m",
            low=round(one.z_m - allowed, 4),
            high=round(one.z_m + allowed, 4),
        ),
        Measured(
            name=f"{one.name}: standard error of that distance, as calibrated",
            value=round(one.stereo_sigma_m, 4),
            unit="m",
        ),
        Measured(name=f"{one.name}: distance by the print", value=round(one.printed_m, 4), unit="m"),
        *(
            Measured(
                name=f"{one.name}: {role} gaze off its calibrated direction",
                value=round(float(np.linalg.norm(error)), 2),
                unit="px",
                high=round(allowed_px, 1),
            )
            for role, error in zip(EYES, one.errors_px, strict=True)
        ),
    ]
    if one.taped_m is not None:
        found.append(Measured(name=f"{one.name}: distance by tape", value=one.taped_m, unit="m"))
    return found


def named(
    measures: Sequence[StationMeasure], limits: AcceptanceLimits, calibration: Calibration
) -> list[NamedFault]:
    """Return what explains the differences, the simplest cause first; nothing where all is within limits."""
    taped = [one for one in measures if one.taped_m is not None]
    printed = _printed(taped, limits)
    if printed:
        return printed
    if all(
        _worst_px(one) <= _allowed_px(one, limits, calibration)
        and abs(one.stereo_rel) * one.z_m <= _allowed_m(one, limits)
        for one in measures
    ):
        return []
    if _is_scale(measures, limits):
        rel = float(np.mean([one.stereo_rel for one in measures]))
        apart_mm = 1e3 * calibration.baseline_m * abs(1.0 / (1.0 + rel) - 1.0)
        size, apart = ("short", "farther apart") if rel < 0.0 else ("long", "closer")
        detail = (
            f"distances by the two gazes are {100.0 * abs(rel):.1f} % too {size} at all {len(measures)} "
            f"stations, print and tape agree: the eyes are about {apart_mm:.1f} mm {apart} than calibrated"
        )
        return [NamedFault(fault=Fault.BASELINE, subject="", detail=detail)]
    return _moved_eyes(measures, limits, calibration)


def _printed(taped: Sequence[StationMeasure], limits: AcceptanceLimits) -> list[NamedFault]:
    """Return a wrong print, or wrongly taped distances: where print and tape differ."""
    differing = [one for one in taped if abs(one.printed_rel) > limits.scale_rel]
    if not differing:
        return []
    by_tape = [one for one in differing if abs(one.stereo_rel - one.printed_rel) < abs(one.printed_rel) / 2.0]
    if by_tape:
        return [
            NamedFault(
                fault=Fault.TAPED_DISTANCE,
                subject=one.name,
                detail=f"{one.name}: {one.taped_m:g} m by tape; print and gazes say {one.stereo_m:.3f} m",
            )
            for one in by_tape
        ]
    percent = 100.0 * float(np.mean([one.printed_rel for one in differing]))
    size = "small" if percent > 0.0 else "large"
    detail = f"the printed markers are {abs(percent):.1f} % too {size}: tape and gazes agree"
    return [NamedFault(fault=Fault.PRINTED_SCALE, subject="", detail=detail)]


def _is_scale(measures: Sequence[StationMeasure], limits: AcceptanceLimits) -> bool:
    """Return whether all distances are wrong by the same factor, as by a wrong baseline."""
    rel = [one.stereo_rel for one in measures]
    if len(rel) < 2 or min(abs(each) for each in rel) <= limits.scale_rel:
        return False
    return max(rel) - min(rel) < 0.5 * abs(float(np.mean(rel)))


def _moved_eyes(
    measures: Sequence[StationMeasure], limits: AcceptanceLimits, calibration: Calibration
) -> list[NamedFault]:
    found = []
    for index, role in enumerate(EYES):
        errors = np.array([one.errors_px[index] for one in measures])
        allowed = max(_allowed_px(one, limits, calibration) for one in measures)
        mean_px = float(np.linalg.norm(errors.mean(axis=0)))
        if mean_px > allowed:
            moved_deg = math.degrees(mean_px / calibration.fovea_f_px)
            detail = (
                f"the {role} gaze is {mean_px:.0f} px ({moved_deg:.3f}°) off its calibration at every station"
            )
            found.append(NamedFault(fault=Fault.MOVED_EYE, subject=str(role), detail=detail))
    if found:
        return found
    worst = max(measures, key=_worst_px)
    detail = (
        f"{worst.name}: the gazes are up to {_worst_px(worst):.0f} px off their calibration, "
        f"and the distance is {100.0 * worst.stereo_rel:+.2f} % off"
    )
    return [NamedFault(fault=Fault.MOVED_EYE, subject="left and right", detail=detail)]


def _worst_px(one: StationMeasure) -> float:
    return float(np.linalg.norm(one.errors_px, axis=1).max())


def _allowed_m(one: StationMeasure, limits: AcceptanceLimits) -> float:
    """Return by how much the distance by the gazes may differ, m."""
    return limits.scale_rel * one.z_m + SIGMAS * one.stereo_sigma_m


def _allowed_px(one: StationMeasure, limits: AcceptanceLimits, calibration: Calibration) -> float:
    return max(limits.residual_px, POSE_SIGMAS * calibration.pose_sigma_px(one.z_m))


def _measure(rig: RigUnderTest, station: Station, calibration: Calibration) -> StationMeasure:
    pose, printed_m = _target(rig, station, calibration)
    point = pose.marker_rig_m(Role.WIDE)
    z_m = float(point[2])
    ax_rad, ay_rad = np.arctan(point[:2] / z_m).tolist()
    volts = calibration.steer(ax_rad, ay_rad, distance_m=float(np.linalg.norm(point)))
    expected = np.array(
        [calibration.fovea_f_px * (point[:2] - calibration.reference_rig_m(role)[:2]) / z_m for role in EYES]
    )
    seen = np.mean(
        [_planes_px(rig, calibration, rig.look(volts, options=REST), z_m) for _ in range(LOOKS)], axis=0
    )
    disparity_px = float(seen[0, 0] - seen[1, 0])
    stereo_m = (
        calibration.fovea_f_px * calibration.baseline_m / disparity_px if disparity_px > 0 else math.inf
    )
    sigma_px = calibration.pose_sigma_px(z_m)
    return StationMeasure(
        name=station.name,
        taped_m=station.distance_m,
        printed_m=printed_m,
        stereo_m=stereo_m,
        stereo_sigma_m=float(
            depth_sigma_m(z_m, sigma_px, f_px=calibration.fovea_f_px, baseline_m=calibration.baseline_m)
        ),
        z_m=z_m,
        errors_px=seen - expected,
    )


def _target(rig: RigUnderTest, station: Station, calibration: Calibration) -> tuple[TargetPose, float]:
    """Return the pose of the markers, at the taped distance if there is one, and the distance by print."""
    frame = rig.access.head.wide(max_age_ms=100.0)
    views = find_markers(
        shades_of(frame), side_m=rig.layout.side_m, only=rig.layout.ids, binning=frame.binning
    )
    by_print = locate_target(views, rig.layout, calibration.wide)
    pose = by_print
    if station.distance_m is not None:
        pose = by_print.at_distance(station.distance_m)
    return pose, by_print.distance_m


def _planes_px(
    rig: RigUnderTest, calibration: Calibration, sighting: Sighting, z_m: float
) -> NDArray[np.float64]:
    """Return the places (2, 2) of the wide camera's marker on both eyes' virtual planes, px."""
    own = rig.layout.wide_id
    places = []
    for role in EYES:
        frame = frame_of(sighting, role)
        views = find_markers(
            shades_of(frame), side_m=rig.layout.side_m, large=True, only=(own,), binning=frame.binning
        )
        if own not in views:
            raise DeviceFault(
                f"the {role} fovea was turned to marker {own} and does not see it",
                remedy="calibrate the rig, or see whether something stands before the markers",
            )
        plane = plane_from_raw(calibration, role, sighting.volts, depth_m=z_m)
        places.append(homography_apply(plane, middle_px(views[own])[None])[0])
    return np.array(places)
