"""A small painted plane seen from three places on a rail, for tests of references: a third of the size.

It is painted by `stereo.rectify.plane_from_raw` at the plane's own depth, not by the reference's geometry.
The rail is not set up along the rig's x: it rises by `RISE` of the way.
"""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from foveacam_hardware.contract import Frame, Role, StereoVolts
from foveacam_pipeline.capture.dataset import CapturedPoint, Dataset, DatasetWriter, PlanPosition, Shot
from foveacam_pipeline.stereo.rectify import plane_from_raw
from tests.support.scenes.dataset_scenes import header, noise_frame
from tests.support.scenes.mosaic_scenes import SIDE, TEXEL_M, Z_M, small_calibration, texture

STOPS_M = (-0.3, 0.0, 0.3)
RISE = 0.002
VERGED_M = 5.5


def rail_scan(folder: Path, *, stops_m: tuple[float, ...] = STOPS_M, follow: float = 1.0) -> Dataset:
    """Return a dataset of one point a stop; `follow`: how far the gaze goes along with the plane's middle."""
    calibration = small_calibration()
    with DatasetWriter.create(folder, header(len(stops_m), calibration=calibration)) as writer:
        for index, rail_m in enumerate(stops_m):
            aim_rad = math.atan(-follow * rail_m / Z_M), 0.0
            volts = calibration.steer(*aim_rad, distance_m=VERGED_M)
            frames = [_fovea(role, volts, rail_m=rail_m) for role in (Role.LEFT, Role.RIGHT)]
            place = PlanPosition(index=index, scan=index, aim_rad=aim_rad, rail_m=rail_m)
            writer.add(CapturedPoint(place=place, shots=tuple(Shot(frame=frame) for frame in frames)))
        writer.finish()
    return Dataset.open(folder)


def _fovea(role: Role, volts: StereoVolts, *, rail_m: float) -> Frame:
    """Return what an eye sees of the plane from a place on the rail."""
    calibration = small_calibration()
    eye_m = calibration.reference_rig_m(role) + rail_m * np.array([1.0, RISE, 0.0])
    metres = np.diag([Z_M / calibration.fovea_f_px, Z_M / calibration.fovea_f_px, 1.0])
    metres[:2, 2] = eye_m[:2]
    texels = np.diag([1.0 / TEXEL_M, 1.0 / TEXEL_M, 1.0])
    texels[:2, 2] = SIDE / 2
    to_texture = texels @ metres @ plane_from_raw(calibration, role, volts, depth_m=Z_M)
    size = calibration.fovea_width, calibration.fovea_height
    image = cv2.warpPerspective(texture(), to_texture, size, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
    noise = np.random.default_rng([round(1e3 * rail_m) + 1000, len(role.value)]).normal(0.0, 1.0, image.shape)
    grey = np.clip(np.rint(image + noise), 0, 255).astype(np.uint8)
    drive = volts.left if role is Role.LEFT else volts.right
    return replace(noise_frame(role, 0), image=grey, volts=drive)
