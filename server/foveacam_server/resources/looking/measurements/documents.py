"""Turns measured values into REST's schemas: metres and degrees, rounded finer than their errors."""

import math

from foveacam_pipeline.measure.length import MeasuredLength
from foveacam_pipeline.measure.plane import MeasuredPlane
from foveacam_pipeline.measure.profile import DepthProfile
from foveacam_server.resources.looking.measurements.point_finder import PlacedPoint
from foveacam_server.resources.looking.measurements.schema import (
    LengthDocument,
    MeasuredPointDocument,
    PlaneDocument,
    ProfileDocument,
    SampleDocument,
    Triple,
)


def point_document(placed: PlacedPoint) -> MeasuredPointDocument:
    """Return a measured point."""
    point = placed.point
    return MeasuredPointDocument(
        view=placed.request.view,
        x_px=round(placed.used_px[0], 2),
        y_px=round(placed.used_px[1], 2),
        snapped_px=round(placed.snapped_px, 2),
        at_edge=placed.at_edge,
        fixation_id=placed.fixation_id,
        point_rig_m=metres((float(point.point_rig_m[0]), *map(float, point.point_rig_m[1:]))),
        point_sigma_m=metres(point.sigma_m),
        distance_m=round(point.distance_m, 6),
        distance_sigma_m=round(point.distance_sigma_m, 6),
    )


def length_document(length: MeasuredLength) -> LengthDocument:
    """Return a length."""
    return LengthDocument(
        length_m=round(length.length_m, 6),
        length_sigma_m=round(length.length_sigma_m, 6),
        delta_rig_m=metres(length.delta_rig_m),
        delta_sigma_m=metres(length.delta_sigma_m),
        same_look=length.same_look,
    )


def plane_document(plane: MeasuredPlane) -> PlaneDocument:
    """Return a plane."""
    return PlaneDocument(
        normal=metres(plane.normal),
        normal_sigma_deg=_deg(plane.normal_sigma_rad),
        pan_deg=_deg(plane.pan_rad),
        pan_sigma_deg=_deg(plane.pan_sigma_rad),
        tilt_deg=_deg(plane.tilt_rad),
        tilt_sigma_deg=_deg(plane.tilt_sigma_rad),
        distance_m=round(plane.distance_m, 6),
        distance_sigma_m=round(plane.distance_sigma_m, 6),
        centre_rig_m=metres(plane.centre_rig_m),
        corners_rig_m=[metres(corner) for corner in plane.corners_rig_m],
        residual_rms_m=round(plane.residual_rms_m, 7),
        expected_rms_m=round(plane.expected_rms_m, 7),
        flatness_m=round(plane.flatness_m, 7),
        pixels=plane.pixels,
        outliers=plane.outliers,
        outlier_fraction=round(plane.outliers / plane.pixels, 4),
    )


def profile_document(profile: DepthProfile, *, start_rig_m: Triple, end_rig_m: Triple) -> ProfileDocument:
    """Return a profile."""
    samples = [
        SampleDocument(
            along_m=round(sample.along_m, 6),
            z_m=None if sample.z_m is None else round(sample.z_m, 6),
            z_sigma_m=None if sample.z_sigma_m is None else round(sample.z_sigma_m, 6),
        )
        for sample in profile.samples
    ]
    known = sum(sample.z_m is not None for sample in samples)
    return ProfileDocument(
        samples=samples,
        start_rig_m=start_rig_m,
        end_rig_m=end_rig_m,
        median_z_m=round(profile.median_z_m, 6),
        shared_sigma_m=round(profile.pose_sigma_m, 6),
        known_fraction=round(known / len(samples), 4),
    )


def metres(values: tuple[float, ...]) -> Triple:
    """Return three values rounded to a micrometre."""
    x, y, z = (round(value, 6) for value in values)
    return x, y, z


def _deg(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 5)
