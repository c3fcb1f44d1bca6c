"""Depth samples from one look of both foveae, and their fusion into the wide context."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.capture.mosaic.pair_depth import NEAREST_M, match_pair, triangulate_pair
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import crossing_z_m, halved, rectify, to_uint8
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.values import Basis, Fixation
from foveacam_pipeline.wide_depth.values import DepthSource
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_pipeline.wide_depth.wide_matches import BLOCK_PX, contradicted, wide_matches

LEAST_OVERLAP = 0.5
"""Least overlap of the foveae for their dense depth to be used; below it a mismatch is hardly detected."""
MEASURED = (Basis.BOTH_FOVEAE, Basis.FOVEA_AND_WIDE)
"""Only distances known in these ways are fused: inferred ones may come from the context itself."""


def overlap_samples(sighting: Sighting, calibration: Calibration) -> DepthSamples:
    """Return the depth where the foveae overlap, matched at a quarter of the size."""
    found = match_pair(halved(rectify(sighting, calibration, scale=0.5)))
    if found is None:
        return DepthSamples.none()
    matched = triangulate_pair(*found, calibration, sighting.volts, eye=Role.LEFT)
    inner = ~matched.edge
    q = matched.per_depth[inner]
    if len(q) == 0:
        return DepthSamples.none()
    x_m = calibration.reference_rig_m(Role.LEFT)[0]
    f_px = calibration.fovea_f_px
    tangents = np.column_stack([matched.u_px[inner] / f_px + x_m * q, matched.v_px[inner] / f_px])
    z_m = max(NEAREST_M, float(1.0 / np.median(q)))
    pose_sigma = calibration.pose_sigma_px(z_m) / (f_px * calibration.baseline_m)
    return DepthSamples(
        tangents=tangents, inverse_z_per_m=q, sigma_per_m=np.hypot(matched.sigma[inner], pose_sigma)
    )


def fuse_look(context: WideContext, sighting: Sighting, calibration: Calibration) -> DepthSamples:
    """Fuse the depth of one look; return its coarse depth, which covers the whole fields of both foveae.

    The coarse depth comes from another pair of images than the dense one, so dense samples that contradict it
    are mismatches and left out.
    """
    wide = gray(to_uint8(sighting.wide))
    coarse = wide_matches(sighting, calibration)
    context.fuse(coarse, source=DepthSource.WIDE_MATCH, gray=wide)
    q_ref = 1.0 / crossing_z_m(calibration, sighting.volts)
    dense = overlap_samples(sighting, calibration)
    overlapping = overlap_share(dense.inverse_z_per_m - q_ref, calibration) >= LEAST_OVERLAP
    mismatched = contradicted(dense, by=coarse, block_tan=BLOCK_PX / calibration.wide.fx_px)
    context.fuse(dense.only(overlapping & ~mismatched), source=DepthSource.DENSE_DEPTH, gray=wide)
    return coarse


def fuse_apart(
    context: WideContext,
    sighting: Sighting,
    calibration: Calibration,
    *,
    expected_per_m: Mapping[Role, float],
) -> DepthSamples:
    """Fuse the depth of one look whose eyes look at different places, of each with the wide view; return it.

    `expected_per_m`: 1/Z about which each eye's depth is searched.
    """
    coarse = wide_matches(sighting, calibration, expected_per_m=expected_per_m)
    context.fuse(coarse, source=DepthSource.WIDE_MATCH, gray=gray(to_uint8(sighting.wide)))
    return coarse


def fuse_fixation(context: WideContext, fixation: Fixation, calibration: Calibration) -> None:
    """Fuse the depth of the last look of a fixation, and its distance if that was measured."""
    if fixation.sighting is None:
        return
    fuse_look(context, fixation.sighting, calibration)
    point, distance_m, sigma_m = fixation.point_rig_m, fixation.distance_m, fixation.distance_sigma_m
    if fixation.basis not in MEASURED or not (point and distance_m and sigma_m):
        return
    x_m, y_m, z_m = point
    sample = DepthSamples(
        tangents=np.array([[x_m / z_m, y_m / z_m]]),
        inverse_z_per_m=np.array([1.0 / z_m]),
        sigma_per_m=np.array([sigma_m / distance_m / z_m]),
    )
    context.fuse(sample, source=DepthSource.FIXATION, gray=gray(to_uint8(fixation.sighting.wide)))


def overlap_share(apart_per_m: NDArray[np.float64], calibration: Calibration) -> NDArray[np.float64]:
    """Return the share of their fields that both foveae see at 1/Z this far from the gazes' crossing."""
    shift_px = np.abs(apart_per_m) * calibration.fovea_f_px * calibration.baseline_m
    return np.asarray(1.0 - shift_px / calibration.fovea_width, dtype=np.float64)
