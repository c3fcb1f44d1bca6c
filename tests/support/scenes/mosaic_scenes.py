"""A small scan of a painted plane for tests of mosaics: a third of the resolution, half overlap.

It is painted by `stereo.rectify.plane_from_raw` at the plane's own depth, not by the mosaic's own geometry.
"""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role, StereoVolts
from foveacam_pipeline.capture.dataset import CapturedPoint, Dataset, DatasetWriter, PlanPosition, Shot
from foveacam_pipeline.models import Calibration
from foveacam_pipeline.models.calibration import EyeCalibration
from foveacam_pipeline.stereo.rectify import plane_from_raw
from tests.support.scenes.dataset_scenes import CALIBRATION, header, noise_frame

PART = 1 / 3
Z_M = 6.0
VERGED_M = 5.0
STEP_DEG = 1.4
TEXEL_M = Z_M / (CALIBRATION.fovea_f_px * PART)
SIDE = 1400


@cache
def small_calibration() -> Calibration:
    """Return the rig's calibration as if its foveae had a third of the pixels."""

    def small(eye: EyeCalibration) -> EyeCalibration:
        field = eye.homography
        x, y = ((c + 0.5) * PART - 0.5 for c in field.centre_px)
        return replace(eye, homography=replace(field, centre_px=(x, y), scale_px=field.scale_px * PART))

    return replace(
        CALIBRATION,
        left=small(CALIBRATION.left),
        right=small(CALIBRATION.right),
        fovea_f_px=CALIBRATION.fovea_f_px * PART,
        fovea_width=round(CALIBRATION.fovea_width * PART),
        fovea_height=round(CALIBRATION.fovea_height * PART),
    )


@cache
def texture() -> NDArray[np.uint8]:
    """Return grain on a plane whose middle lies on the rig's axis, `TEXEL_M` a px."""
    rng = np.random.default_rng(4)
    grain = rng.standard_normal((SIDE, SIDE)).astype(np.float32)
    mixed = 2.0 * cv2.GaussianBlur(grain, (0, 0), 1.6) + 12.0 * cv2.GaussianBlur(grain, (0, 0), 9.0)
    return np.asarray(np.clip(128.0 + 110.0 * mixed, 0, 255), dtype=np.uint8)


def scan(
    folder: Path, *, wide: bool = False, points: int = 4, step_deg: float = STEP_DEG, capture_id: str = "test"
) -> Dataset:
    """Return a dataset of up to four points that look at the plane; they are verged a little before it."""
    calibration = small_calibration()
    places = [(column - 0.5, row - 0.5) for row in (0, 1) for column in (0, 1)][:points]
    with DatasetWriter.create(
        folder, header(len(places), calibration=calibration, capture_id=capture_id)
    ) as writer:
        for index, (x, y) in enumerate(places):
            aim_rad = math.radians(x * step_deg), math.radians(0.75 * y * step_deg)
            volts = calibration.steer(*aim_rad, distance_m=VERGED_M)
            frames = [fovea(role, volts) for role in (Role.LEFT, Role.RIGHT)]
            if wide and index == 1:
                frames.append(wide_frame())
            place = PlanPosition(index=index, aim_rad=aim_rad, distance_m=VERGED_M)
            writer.add(CapturedPoint(place=place, shots=tuple(Shot(frame=frame) for frame in frames)))
        writer.finish()
    return Dataset.open(folder)


def fovea(role: Role, volts: StereoVolts) -> Frame:
    """Return what an eye sees of the plane."""
    drive = volts.left if role is Role.LEFT else volts.right
    return replace(noise_frame(role, 0), image=painted(texture(), role, volts, z_m=Z_M), volts=drive)


def painted(picture: NDArray[np.uint8], role: Role, volts: StereoVolts, *, z_m: float) -> NDArray[np.uint8]:
    """Return what an eye sees of a picture (SIDE, SIDE) on a plane; its texels look equally large."""
    calibration = small_calibration()
    metres = np.diag([z_m / calibration.fovea_f_px, z_m / calibration.fovea_f_px, 1.0])
    metres[:2, 2] = calibration.reference_rig_m(role)[:2]
    texel_m = TEXEL_M * z_m / Z_M
    texels = np.diag([1.0 / texel_m, 1.0 / texel_m, 1.0])
    texels[:2, 2] = SIDE / 2
    to_texture = texels @ metres @ plane_from_raw(calibration, role, volts, depth_m=z_m)
    size = calibration.fovea_width, calibration.fovea_height
    image = cv2.warpPerspective(picture, to_texture, size, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
    return np.asarray(image, dtype=np.uint8)


def wide_frame() -> Frame:
    """Return what the wide camera sees of the plane, as far as the foveae look."""
    wide = small_calibration().wide
    image = np.full((wide.height, wide.width), 128, dtype=np.uint8)
    rows, columns = slice(430, 650), slice(480, 960)
    y, x = np.mgrid[rows, columns]
    tangents = np.tan(wide.angles_rad(np.column_stack([x.ravel(), y.ravel()])))
    places = (tangents * Z_M / TEXEL_M + SIDE / 2).reshape(*x.shape, 2).astype(np.float32)
    blurred = cv2.GaussianBlur(texture(), (0, 0), 2.5)
    image[rows, columns] = cv2.remap(blurred, places[..., 0], places[..., 1], cv2.INTER_LINEAR)
    return replace(noise_frame(Role.WIDE, 0), image=image)
