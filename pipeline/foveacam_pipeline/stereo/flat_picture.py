"""Place what one fovea saw as a flat picture in the rig frame, where no pair gives a shape."""

import numpy as np

from foveacam_hardware.contract import Frame, InvalidInput, Role, StereoVolts
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.depth import rgb
from foveacam_pipeline.stereo.mesh import grid_faces
from foveacam_pipeline.stereo.rectify import plane_from_raw, to_uint8
from foveacam_pipeline.stereo.values import DepthMesh

CELLS = 4
"""Cells of the mesh in each direction: a texture is interpolated affinely within each triangle, the view of a
mirror that is turned aside is a perspective one."""


def flat_picture(
    frame: Frame, role: Role, volts: StereoVolts, calibration: Calibration, *, z_m: float
) -> DepthMesh:
    """Return a fovea's whole frame as a plane at depth `z_m` (along the rig's z), facing the rig.

    From the eye's pinhole each of its points lies in the direction in which the frame shows it. Nothing but
    `z_m` says how far these are.
    """
    if not (np.isfinite(z_m) and z_m > 0.0):
        raise InvalidInput(
            f"flat picture at a depth of {z_m!r} m: a finite depth in front of the rig is needed"
        )
    own = calibration.binned(frame.binning)
    share = np.linspace(0.0, 1.0, CELLS + 1)
    uv = np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2)
    raw_px = uv * (own.fovea_width, own.fovea_height) - 0.5
    plane_px = homography_apply(plane_from_raw(own, role, volts, depth_m=z_m), raw_px)
    across_m = plane_px * (z_m / own.fovea_f_px)
    across_m[:, 0] += (-0.5 if role is Role.LEFT else 0.5) * calibration.baseline_m
    return DepthMesh(
        vertices_rig_m=np.column_stack([across_m, np.full(len(uv), z_m)]).astype(np.float32),
        faces=grid_faces(CELLS + 1, CELLS + 1).astype(np.uint32),
        uv=uv.astype(np.float32),
        texture=np.ascontiguousarray(rgb(to_uint8(frame))),
    )
