"""From two raw foveae to a rectified pair: windows of the virtual pinholes of Sec. 3.2.

Each raw image is warped once, by H(ax, ay) of its pose, straight to the scale asked for. Knows no matching.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, InvalidInput, MirrorVolts, Role, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.values import RectifiedPair

SCALES = (0.5, 1.0)
EDGE_PX = 2.0
"""Width of the rim of a raw frame that counts as not seen: interpolation and filter reach over it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EyePose:
    """Where one eye looked: its gaze (axis-wise tangents), its virtual pupil, and the warp into its plane.

    `plane_from_raw`: (3, 3) float64, raw fovea px to px of the virtual pinhole plane at full scale.
    """

    gaze_tan: tuple[float, float]
    centre_rig_m: NDArray[np.float64]
    plane_from_raw: NDArray[np.float64]
    sigma_px: float
    """Standard error of the plane's origin along x from the mirror model, px at full scale."""


def rectify(sighting: Sighting, calibration: Calibration, *, scale: float = 0.5) -> RectifiedPair:
    """Warp both foveae of a look into windows that share v0; zero residual is where the two gazes cross."""
    if scale not in SCALES:
        raise InvalidInput(f"rectify at scale {scale!r}: only 0.5 and 1.0 are made; pass one of them")
    left = eye_pose(calibration, Role.LEFT, sighting.volts.left)
    right = eye_pose(calibration, Role.RIGHT, sighting.volts.right)
    right_plane = _levelled(left, right, calibration.fovea_f_px)
    width, height = round(calibration.fovea_width * scale), round(calibration.fovea_height * scale)
    centre = np.array([(calibration.fovea_width - 1) / 2, (calibration.fovea_height - 1) / 2, 1.0])
    u_left, v_left = scale * _dehomogenised(left.plane_from_raw @ centre)
    u_right, v_right = scale * _dehomogenised(right_plane @ centre)
    u0_left, u0_right = u_left - (width - 1) / 2, u_right - (width - 1) / 2
    v0 = (v_left + v_right) / 2 - (height - 1) / 2
    window_left = _scaled(scale, u0_left, v0) @ left.plane_from_raw
    window_right = _scaled(scale, u0_right, v0) @ right_plane
    return RectifiedPair(
        left=warp(to_uint8(sighting.left), window_left, scale=scale, size=(width, height)),
        right=warp(to_uint8(sighting.right), window_right, scale=scale, size=(width, height)),
        valid_left=_seen(sighting.left, window_left, (width, height)),
        valid_right=_seen(sighting.right, window_right, (width, height)),
        f_px=calibration.fovea_f_px * scale,
        baseline_m=float(right.centre_rig_m[0] - left.centre_rig_m[0]),
        u0_left_px=float(u0_left),
        u0_right_px=float(u0_right),
        v0_px=float(v0),
        left_centre_rig_m=(
            float(left.centre_rig_m[0]),
            float(left.centre_rig_m[1]),
            float(left.centre_rig_m[2]),
        ),
        pose_sigma_px=scale * math.hypot(left.sigma_px, right.sigma_px),
        t_ns=sighting.left.t_ns,
    )


def eye_pose(calibration: Calibration, role: Role, volts: MirrorVolts) -> EyePose:
    """Return where an eye looks with these volts, and the warp of its raw image into its virtual plane."""
    eye = calibration.eye(role)
    ax_rad, ay_rad = eye.mirror.angles_rad(volts)
    tangents = (math.tan(ax_rad), math.tan(ay_rad))
    f_px = calibration.fovea_f_px
    to_plane = np.array([[1.0, 0.0, f_px * tangents[0]], [0.0, 1.0, f_px * tangents[1]], [0.0, 0.0, 1.0]])
    gaze = np.array([*tangents, 1.0])
    side = -0.5 if role is Role.LEFT else 0.5
    pivot_m = np.array([side * calibration.baseline_m, 0.0, 0.0])
    return EyePose(
        gaze_tan=tangents,
        centre_rig_m=pivot_m - gaze * (calibration.pupil_m / np.linalg.norm(gaze)),
        plane_from_raw=to_plane @ eye.homography.at(ax_rad, ay_rad),
        sigma_px=f_px * eye.mirror.sigma_rad * (1.0 + tangents[0] ** 2),
    )


def to_uint8(frame: Frame) -> NDArray[np.uint8]:
    """Return the image of a frame with its upper eight significant bits."""
    image = frame.image
    if image.dtype == np.uint8:
        return np.asarray(image, dtype=np.uint8)
    return np.asarray(image >> max(0, frame.bits - 8), dtype=np.uint8)


def warp(
    image: NDArray[np.uint8], window_from_raw: NDArray[np.float64], *, scale: float, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """Resample a raw image into a window of `size` (width, height); below scale 1 it is averaged first.

    The optics pass hardly anything above a quarter cycle a pixel (f/21.5, Table 2), so that at half scale the
    mean of 2 x 2 pixels is filter enough; it moves the samples by half a pixel, which the matrix takes back.
    """
    if scale < 1.0:
        image = np.asarray(cv2.blur(image, (2, 2), anchor=(0, 0)), dtype=np.uint8)
        window_from_raw = window_from_raw @ np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    return np.asarray(
        cv2.warpPerspective(image, window_from_raw, size, flags=cv2.INTER_LINEAR), dtype=np.uint8
    )


def _levelled(left: EyePose, right: EyePose, f_px: float) -> NDArray[np.float64]:
    """Return the right eye's `plane_from_raw` as seen from a pupil level with the left one.

    The two pupils differ by fractions of a millimetre along y and z too, as the mirrors tilt. Their parallax
    is taken out for the depth at which the gazes cross; what remains at other depths is of second order.
    """
    step_m = right.centre_rig_m - left.centre_rig_m
    inverse_z = max(0.0, (left.gaze_tan[0] - right.gaze_tan[0]) / float(step_m[0]))
    shrink = 1.0 - float(step_m[2]) * inverse_z
    shift_px = f_px * float(step_m[1]) * inverse_z
    level = np.array([[shrink, 0.0, 0.0], [0.0, shrink, shift_px], [0.0, 0.0, 1.0]])
    return np.asarray(level @ right.plane_from_raw, dtype=np.float64)


def _scaled(scale: float, u0_px: float, v0_px: float) -> NDArray[np.float64]:
    """Return (3, 3) window px from plane px at full scale."""
    return np.array([[scale, 0.0, -u0_px], [0.0, scale, -v0_px], [0.0, 0.0, 1.0]])


def _dehomogenised(point: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(point[:2] / point[2], dtype=np.float64)


def _seen(frame: Frame, window_from_raw: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return (height, width) bool: which window pixels come from inside the raw frame."""
    height, width = frame.image.shape[:2]
    right, bottom = width - 1 - EDGE_PX, height - 1 - EDGE_PX
    corners = np.array([[EDGE_PX, EDGE_PX], [right, EDGE_PX], [right, bottom], [EDGE_PX, bottom]])
    mapped = cv2.perspectiveTransform(corners[None], window_from_raw)[0]
    mask = np.zeros((size[1], size[0]), dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.rint(mapped * 16).astype(np.int32), 1, shift=4)
    return mask.astype(np.bool_)
