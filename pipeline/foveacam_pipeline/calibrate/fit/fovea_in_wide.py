"""Resampling of a fovea image into the wide image by the fitted models alone (lens, mirror, homography)."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.geometry.angles import tan_from_angles
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.footprint import fovea_footprint_px
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import crossing_z_m, plane_from_raw, to_uint8

_MOST_REDUCED = 8
"""Reduction of a fovea, nine times finer than the wide view, before it is resampled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WideWindow:
    """A part of the wide image at `zoom` window px a wide px; (x0, y0) is the wide px of its first pixel."""

    x0_px: float
    y0_px: float
    width: int
    height: int
    zoom: float = 1.0

    @property
    def pixels(self) -> NDArray[np.float64]:
        """(height * width, 2) raw wide px of the window's pixels, row by row."""
        x, y = np.meshgrid(np.arange(self.width) / self.zoom, np.arange(self.height) / self.zoom)
        return np.column_stack([x.ravel() + self.x0_px, y.ravel() + self.y0_px])


def footprint_window(calibration: Calibration, role: Role, sighting: Sighting, *, zoom: float) -> WideWindow:
    """Return the window of the wide image that holds all of a fovea's field."""
    drive = sighting.volts.left if role is Role.LEFT else sighting.volts.right
    corners = fovea_footprint_px(calibration, role, drive, crossing_z_m(calibration, sighting.volts))
    size = np.array([calibration.wide.width, calibration.wide.height])
    low = np.clip(np.floor(corners.min(axis=0)), 0, size - 1)
    high = np.clip(np.ceil(corners.max(axis=0)), low + 1, size - 1)
    width, height = (zoom * (high - low) + 1).astype(int).tolist()
    return WideWindow(x0_px=float(low[0]), y0_px=float(low[1]), width=width, height=height, zoom=zoom)


def fovea_in_wide(
    sighting: Sighting, calibration: Calibration, role: Role, window: WideWindow
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return a fovea resampled into a window of the wide image, grey (h, w), and the mask of its field.

    The scene is assumed at the depth at which the two gazes cross.
    """
    image = gray(to_uint8(sighting.left if role is Role.LEFT else sighting.right))
    raw = raw_px_of(calibration, role, sighting, window.pixels).reshape(window.height, window.width, 2)
    height, width = image.shape
    seen = ((raw > 1.0) & (raw < np.array([width - 2.0, height - 2.0]))).all(axis=2)
    reduced = max(1, min(_MOST_REDUCED, round(_MOST_REDUCED / window.zoom)))
    small = cv2.resize(image, (width // reduced, height // reduced), interpolation=cv2.INTER_AREA)
    places = ((raw + 0.5) / reduced - 0.5).astype(np.float32)
    shown = cv2.remap(
        small, places[..., 0], places[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(shown, dtype=np.uint8), np.asarray(seen)


def raw_px_of(
    calibration: Calibration, role: Role, sighting: Sighting, wide_px: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the raw fovea px (n, 2) that show the same as raw wide px (n, 2)."""
    depth_m = crossing_z_m(calibration, sighting.volts)
    tangents = tan_from_angles(calibration.wide.angles_rad(wide_px))
    if np.isfinite(depth_m):
        tangents = tangents - calibration.reference_rig_m(role)[:2] / depth_m
    plane = plane_from_raw(calibration, role, sighting.volts, depth_m=depth_m)
    points = np.column_stack([calibration.fovea_f_px * tangents, np.ones(len(tangents))])
    raw = points @ np.linalg.inv(plane).T
    return np.asarray(raw[:, :2] / raw[:, 2:], dtype=np.float64)
