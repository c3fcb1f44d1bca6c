"""Converts a camera's frame into what is recorded: its pixels as delivered, and the pose of the exposure."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, MirrorVolts, Role
from foveacam_pipeline.capture.recording.pixels import payload_of, stream_format
from foveacam_pipeline.capture.recording.values import FramePose, RawFrame
from foveacam_pipeline.models.calibration import Calibration

AVERAGED = "fin-averaged"
"""The volts are the mean over the exposure, as the controller reported it at the end."""


def wide_from_fovea(
    calibration: Calibration, role: Role, *, angles_rad: tuple[float, float]
) -> NDArray[np.float64]:
    """Return (3, 3) float64: raw fovea px to px of the undistorted wide view, for objects at infinity."""
    ax_rad, ay_rad = angles_rad
    f_px = calibration.fovea_f_px
    tangents = np.array(
        [[1 / f_px, 0.0, math.tan(ax_rad)], [0.0, 1 / f_px, math.tan(ay_rad)], [0.0, 0.0, 1.0]]
    )
    found = calibration.wide.matrix @ tangents @ calibration.eye(role).homography.at(ax_rad, ay_rad)
    found /= found[2, 2]
    return np.asarray(found, dtype=np.float64)


def pose_at(
    role: Role, volts: MirrorVolts | None, *, exposure_ns: int, calibration: Calibration | None
) -> FramePose:
    """Return the pose of an exposure; angles and footprint need a calibration, and a mirror."""
    if role is Role.WIDE or volts is None:
        return FramePose(exposure_ns=exposure_ns)
    if calibration is None:
        return FramePose(volts=volts, volts_source=AVERAGED, exposure_ns=exposure_ns)
    angles_rad = calibration.eye(role).mirror.angles_rad(volts)
    return FramePose(
        volts=volts,
        volts_source=AVERAGED,
        angles_rad=angles_rad,
        wide_from_fovea=wide_from_fovea(calibration, role, angles_rad=angles_rad),
        exposure_ns=exposure_ns,
    )


def raw_frame(frame: Frame, *, calibration: Calibration | None = None, packed: bool = False) -> RawFrame:
    """Return what is recorded of a frame; `packed`: grey of twelve bits in three bytes for two pixels."""
    form = replace(stream_format(frame.image, bits=frame.bits, packed=packed), binning=frame.binning)
    pose = pose_at(frame.role, frame.volts, exposure_ns=frame.exposure_ns, calibration=calibration)
    return RawFrame(
        payload=payload_of(frame.image, form),
        form=form,
        seq=frame.seq,
        t_ns=frame.t_ns,
        pose=replace(pose, frame_id=frame.frame_id),
    )
