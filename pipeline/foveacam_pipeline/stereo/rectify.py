"""Rectify two raw foveae to windows of the virtual pinholes of Sec. 3.2.

Each raw image is warped once, by H(ax, ay) of its pose, directly to the requested scale.
"""

import math
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, InvalidInput, Role, Sighting, StereoVolts
from foveacam_pipeline.geometry.binning import common_binning
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.values import RectifiedPair

SCALES = (0.5, 1.0)
EDGE_PX = 2.0
"""Width of the border of a raw frame that counts as invalid, because interpolation and filter cross it."""


def rectify(sighting: Sighting, calibration: Calibration, *, scale: float = 0.5) -> RectifiedPair:
    """Warp both foveae of a look into windows that share v0; zero residual is where the two gazes cross.

    `scale`: window px per sensor px, which frames binned by 2 allow up to 0.5.
    """
    return rectify_frames(sighting.left, sighting.right, sighting.volts, calibration, scale=scale)


def rectify_frames(
    left_frame: Frame, right_frame: Frame, volts: StereoVolts, calibration: Calibration, *, scale: float = 0.5
) -> RectifiedPair:
    """Warp both foveae's frames of one exposure under `volts`, as `rectify` does."""
    if scale not in SCALES:
        raise InvalidInput(f"rectify at scale {scale!r}: only 0.5 and 1.0 are made; pass one of them")
    of_frame = scale * common_binning(left_frame, right_frame)
    if of_frame > 1.0:
        raise InvalidInput(
            f"rectify at scale {scale!r}: the frames are binned by 2 and show no more than scale 0.5; pass "
            "0.5, or look at full resolution"
        )
    z_m, own = crossing_z_m(calibration, volts), calibration.binned(left_frame.binning)
    left, right = (plane_from_raw(own, role, volts, depth_m=z_m) for role in (Role.LEFT, Role.RIGHT))
    size = round(calibration.fovea_width * scale), round(calibration.fovea_height * scale)
    middle = np.array([(own.fovea_width - 1) / 2, (own.fovea_height - 1) / 2])
    u_left, v_left = of_frame * _mapped(left, middle)
    u_right, v_right = of_frame * _mapped(right, middle)
    u0_left, u0_right = float(u_left) - (size[0] - 1) / 2, float(u_right) - (size[0] - 1) / 2
    v0 = float(v_left + v_right) / 2 - (size[1] - 1) / 2
    window_left = _window_from_plane(of_frame, u0_left, v0) @ left
    window_right = _window_from_plane(of_frame, u0_right, v0) @ right
    return RectifiedPair(
        left=warp(to_uint8(left_frame), window_left, scale=of_frame, size=size),
        right=warp(to_uint8(right_frame), window_right, scale=of_frame, size=size),
        valid_left=_seen(left_frame, window_left, size),
        valid_right=_seen(right_frame, window_right, size),
        f_px=calibration.fovea_f_px * scale,
        baseline_m=calibration.baseline_m,
        u0_left_px=u0_left,
        u0_right_px=u0_right,
        v0_px=v0,
        pose_sigma_px=scale * calibration.pose_sigma_px(z_m),
        t_ns=left_frame.t_ns,
    )


def halved(pair: RectifiedPair) -> RectifiedPair:
    """Return the pair at half the size."""
    height, width = pair.left.shape[:2]
    size = (width // 2, height // 2)

    def small(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        even = image[: 2 * size[1], : 2 * size[0]]
        return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)

    return replace(
        pair,
        left=small(pair.left),
        right=small(pair.right),
        valid_left=small(255 * pair.valid_left.astype(np.uint8)) == 255,
        valid_right=small(255 * pair.valid_right.astype(np.uint8)) == 255,
        f_px=pair.f_px / 2,
        u0_left_px=pair.u0_left_px / 2 + 0.25,
        u0_right_px=pair.u0_right_px / 2 + 0.25,
        v0_px=pair.v0_px / 2 + 0.25,
        pose_sigma_px=pair.pose_sigma_px / 2,
    )


def crossing_z_m(calibration: Calibration, volts: StereoVolts) -> float:
    """Return the depth along z at which the gazes cross, m; infinity when they run parallel or apart."""
    meeting = calibration.meeting(volts)
    return float(meeting.point_m[2]) if meeting.in_front else math.inf


def plane_from_raw(
    calibration: Calibration, role: Role, volts: StereoVolts, *, depth_m: float
) -> NDArray[np.float64]:
    """Return (3, 3) float64: raw fovea px to px of the eye's virtual plane, for what is at `depth_m`.

    Both are px of the calibration: of binned frames and a plane of half the focal length for one that is
    `binned(2)`.

    Pupil and pivot lie a little beside the pinhole. Their parallax is removed for that depth; the remainder
    at other depths is of second order and nearly the same in both eyes.
    """
    drive = volts.left if role is Role.LEFT else volts.right
    ax_rad, ay_rad = calibration.eye(role).mirror.angles_rad(drive)
    f_px = calibration.fovea_f_px
    to_gaze = np.array(
        [[1.0, 0.0, f_px * math.tan(ax_rad)], [0.0, 1.0, f_px * math.tan(ay_rad)], [0.0, 0.0, 1.0]]
    )
    about_gaze = calibration.rectification(role, ax_rad, ay_rad, depth_m=depth_m)
    return np.asarray(to_gaze @ about_gaze, dtype=np.float64)


def window_from_raw(
    calibration: Calibration,
    role: Role,
    volts: StereoVolts,
    *,
    scale: float,
    origin_px: tuple[float, float],
) -> NDArray[np.float64]:
    """Return (3, 3) float64: sensor px to px of the eye's window of a look, as `rectify` warps it.

    `origin_px`: (u0, v0) of that window at its scale.
    """
    plane = plane_from_raw(calibration, role, volts, depth_m=crossing_z_m(calibration, volts))
    return np.asarray(_window_from_plane(scale, *origin_px) @ plane, dtype=np.float64)


def to_uint8(frame: Frame) -> NDArray[np.uint8]:
    """Return the image of a frame with its upper eight significant bits."""
    image = frame.image
    if image.dtype == np.uint8:
        return np.asarray(image, dtype=np.uint8)
    return np.asarray(image >> max(0, frame.bits - 8), dtype=np.uint8)


def warp(
    image: NDArray[np.uint8], window_from_raw: NDArray[np.float64], *, scale: float, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """Resample a raw image into a window of `size` (width, height).

    At half scale the image is first halved by the mean of 2 x 2 pixels. No other filter is needed, since the
    optics pass hardly anything above a quarter cycle a pixel (f/21.5, Table 2). Warping the full image would
    be a tenth more exact and cost twice as much.
    """
    if scale < 1.0:
        height, width = image.shape[:2]
        image = np.asarray(
            cv2.resize(image, (width // 2, height // 2), interpolation=cv2.INTER_AREA), dtype=np.uint8
        )
        window_from_raw = window_from_raw @ np.array([[2.0, 0.0, 0.5], [0.0, 2.0, 0.5], [0.0, 0.0, 1.0]])
    warped = cv2.warpPerspective(image, window_from_raw, size, flags=cv2.INTER_LINEAR)
    return np.asarray(warped, dtype=np.uint8)


def _window_from_plane(scale: float, u0_px: float, v0_px: float) -> NDArray[np.float64]:
    """Return (3, 3) window px from plane px at full scale."""
    return np.array([[scale, 0.0, -u0_px], [0.0, scale, -v0_px], [0.0, 0.0, 1.0]])


def _mapped(homography: NDArray[np.float64], point_px: NDArray[np.float64]) -> NDArray[np.float64]:
    u, v, w = homography @ np.append(point_px, 1.0)
    return np.array([u / w, v / w])


def _seen(frame: Frame, window_from_raw: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return (height, width) bool: which window pixels come from inside the raw frame."""
    height, width = frame.image.shape[:2]
    right, bottom = width - 1 - EDGE_PX, height - 1 - EDGE_PX
    corners = np.array([[EDGE_PX, EDGE_PX], [right, EDGE_PX], [right, bottom], [EDGE_PX, bottom]])
    mapped = np.array([_mapped(window_from_raw, corner) for corner in corners])
    mask = np.zeros((size[1], size[0]), dtype=np.uint8)
    cv2.fillConvexPoly(mask, np.rint(mapped * 16).astype(np.int32), (1,), shift=4)
    return mask.astype(np.bool_)
