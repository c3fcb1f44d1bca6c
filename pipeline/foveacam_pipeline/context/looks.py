"""What one look of both foveae tells of depth: dense where they overlap, as samples of the rig frame."""

import numpy as np

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.capture.mosaic.pair_depth import NEAREST_M, halved, matched, triangulated
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import edge_mask, points_rig_m
from foveacam_pipeline.stereo.rectify import rectify
from foveacam_pipeline.stereo.values import DepthMap, RectifiedPair
from foveacam_pipeline.verge.depth_samples import DepthSamples

STEP_PX = 4
"""Every fourth pixel of a half-size depth map: some 20 points a wide pixel in each direction of a cell."""


def overlap_samples(sighting: Sighting, calibration: Calibration) -> DepthSamples:
    """Return the depth where the foveae overlap, matched at a quarter of the size."""
    found = matched(halved(rectify(sighting, calibration, scale=0.5)))
    if found is None:
        return DepthSamples.none()
    seen = triangulated(*found, calibration, sighting.volts, eye=Role.LEFT)
    kept = ~seen.edge
    q = seen.per_depth[kept]
    if len(q) == 0:
        return DepthSamples.none()
    x_m = calibration.reference_rig_m(Role.LEFT)[0]
    f_px = calibration.fovea_f_px
    tangents = np.column_stack([seen.u_px[kept] / f_px + x_m * q, seen.v_px[kept] / f_px])
    z_m = max(NEAREST_M, float(1.0 / np.median(q)))
    pose_sigma = calibration.pose_sigma_px(z_m) / (f_px * calibration.baseline_m)
    return DepthSamples(
        tangents=tangents, inverse_z_per_m=q, sigma_per_m=np.hypot(seen.sigma[kept], pose_sigma)
    )


def map_samples(pair: RectifiedPair, depth: DepthMap) -> DepthSamples:
    """Return a depth map as samples, thinned, without the pixels beside a jump of depth."""
    usable = np.isfinite(depth.z_m) & np.isfinite(depth.sigma_m) & ~edge_mask(pair, depth)
    rows, columns = np.nonzero(usable[::STEP_PX, ::STEP_PX])
    rows, columns = rows * STEP_PX, columns * STEP_PX
    z_m = depth.z_m[rows, columns]
    points_m = points_rig_m(pair, columns, rows, z_m).astype(np.float64)
    sigma_m = np.hypot(depth.sigma_m, depth.pose_sigma_m)[rows, columns].astype(np.float64)
    return DepthSamples(
        tangents=points_m[:, :2] / points_m[:, 2:],
        inverse_z_per_m=1.0 / points_m[:, 2],
        sigma_per_m=sigma_m / points_m[:, 2] ** 2,
    )
