"""What one look of both foveae tells of depth: dense where they overlap, as samples of the rig frame."""

import numpy as np

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.capture.mosaic.pair_depth import NEAREST_M, matched, triangulated
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.rectify import halved, rectify
from foveacam_pipeline.verge.depth_samples import DepthSamples


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
