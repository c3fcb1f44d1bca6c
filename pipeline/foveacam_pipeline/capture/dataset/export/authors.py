"""Export to the folders of the authors' application: wide, and numbered fovea, center, left, right, diff.

`fovea` holds Q (millimetres) and the baseline; `left` and `right` are the rectified foveae at 16 bits with
volts, angles and intrinsics beside them; `center` is the wide view around the target; `diff` is left minus
right. Q belongs to these images: both foveae are windows of the virtual pinholes, with zero disparity where
the gazes cross.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, Role, StereoVolts
from foveacam_pipeline.capture.dataset.export.target import ExportChoice, write_png
from foveacam_pipeline.capture.dataset.export.views import Matrix, pose_calibration, wide_view
from foveacam_pipeline.capture.dataset.reader import Dataset, DatasetPoint
from foveacam_pipeline.geometry.binning import enlarge, sensor_from_picture
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.stereo.rectify import crossing_z_m, plane_from_raw

MM = 1e3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Window16:
    """A rectified fovea image: (h, w) or (h, w, 3) uint16, at (u0, v0) of its plane, px at full scale."""

    image: NDArray[np.uint16]
    u0_px: float
    v0_px: float


def export_authors(dataset: Dataset, folder: Path, choice: ExportChoice) -> None:
    """Write the whole dataset into an empty folder; the files of a single point carry no number."""
    calibration = pose_calibration(dataset)
    count = len(dataset)
    digits = max(2, len(str(count)))
    for number, point in enumerate(dataset):
        index = f"{number:0{digits}d}" if count > 1 else None
        flat = _flat_wide(point, calibration) if _has_wide(point) else None
        if number == 0:
            _write_resource(folder, "wide", None, flat, _wide_facts(calibration))
        sighting = point.sighting()
        windows = windows_of(calibration, sighting.left, sighting.right, sighting.volts)
        facts = {
            "Q": q_matrix(calibration, *windows).tolist(),
            "baseline": calibration.baseline_m * MM,
            "baseline.unit": "millimeter",
        }
        _write_resource(folder, "fovea", index, None, facts)
        for frame, window in zip((sighting.left, sighting.right), windows, strict=True):
            _write_resource(
                folder,
                frame.role.value,
                index,
                window.image,
                _eye_facts(calibration, frame.role, sighting.volts, window),
            )
        if flat is not None:
            _write_resource(folder, "center", index, _centre(calibration, flat, sighting.volts), None)
        _write_resource(folder, "diff", index, _difference(*(window.image for window in windows)), None)
        choice.report_point(point.index)


def _flat_wide(point: DatasetPoint, calibration: Calibration) -> NDArray[np.uint8]:
    """Return the wide view without its distortion, at the size of its sensor."""
    flat = wide_view(point, calibration).image
    return enlarge(flat, binning=calibration.wide.binning_of(flat.shape))


def windows_of(
    calibration: Calibration, left: Frame, right: Frame, volts: StereoVolts
) -> tuple[Window16, Window16]:
    """Return both foveae as 16-bit windows of their planes, at full scale, sharing v0."""
    depth_m = crossing_z_m(calibration, volts)
    size = calibration.fovea_width, calibration.fovea_height
    middle = np.array([(size[0] - 1) / 2, (size[1] - 1) / 2, 1.0])
    planes = [plane_from_raw(calibration, role, volts, depth_m=depth_m) for role in (Role.LEFT, Role.RIGHT)]
    centres = [(plane @ middle)[:2] / (plane @ middle)[2] for plane in planes]
    v0_px = float(np.mean([centre[1] for centre in centres])) - middle[1]
    found = []
    for frame, plane, centre in zip((left, right), planes, centres, strict=True):
        u0_px = float(centre[0]) - middle[0]
        window = np.array([[1.0, 0.0, -u0_px], [0.0, 1.0, -v0_px], [0.0, 0.0, 1.0]]) @ plane
        window = window @ sensor_from_picture(frame.binning)
        warped = cv2.warpPerspective(_as_16_bits(frame), window, size, flags=cv2.INTER_LINEAR)
        found.append(Window16(image=np.asarray(warped, dtype=np.uint16), u0_px=u0_px, v0_px=float(v0_px)))
    return found[0], found[1]


def q_matrix(calibration: Calibration, left: Window16, right: Window16) -> Matrix:
    """Return (4, 4): Q (x, y, d, 1) is a point in mm from the left eye, d = x left - x right."""
    baseline_mm = calibration.baseline_m * MM
    return np.array(
        [
            [1.0, 0.0, 0.0, left.u0_px],
            [0.0, 1.0, 0.0, left.v0_px],
            [0.0, 0.0, 0.0, calibration.fovea_f_px],
            [0.0, 0.0, 1.0 / baseline_mm, (left.u0_px - right.u0_px) / baseline_mm],
        ]
    )


def _wide_facts(calibration: Calibration) -> dict[str, object]:
    wide = calibration.wide
    low_x, high_x, low_y, high_y = wide.field_rad
    return {
        "sensor_size": {"width": wide.width, "height": wide.height},
        "focal": {"x": wide.fx_px, "y": wide.fy_px},
        "center": {"x": wide.cx_px, "y": wide.cy_px},
        "fov": {"x": high_x - low_x, "y": high_y - low_y},
    }


def _eye_facts(
    calibration: Calibration, role: Role, volts: StereoVolts, window: Window16
) -> dict[str, object]:
    drive = eye_volts(volts, role)
    ax_rad, ay_rad = calibration.eye(role).mirror.angles_rad(drive)
    return {
        "sensor_size": {"width": calibration.fovea_width, "height": calibration.fovea_height},
        "volt": {"x": drive.x_v, "y": drive.y_v},
        "volt.unit": "volt",
        "angle": {"x": ax_rad, "y": ay_rad},
        "angle.unit": "radian",
        "intrinsics": {
            "fx": calibration.fovea_f_px,
            "fy": calibration.fovea_f_px,
            "cx": -window.u0_px,
            "cy": -window.v0_px,
        },
    }


def _centre(calibration: Calibration, flat: NDArray[np.uint8], volts: StereoVolts) -> NDArray[np.uint8]:
    """Return the part of the undistorted wide view around the target that is as large as a fovea's field."""
    wide = calibration.wide
    left, right = calibration.gaze_rad(volts)
    tangents = [(math.tan(a) + math.tan(b)) / 2 for a, b in zip(left, right, strict=True)]
    f_px = math.sqrt(wide.fx_px * wide.fy_px)
    zoom = calibration.fovea_f_px / f_px
    size = round(calibration.fovea_width / zoom), round(calibration.fovea_height / zoom)
    x = round(wide.cx_px + f_px * tangents[0] - size[0] / 2)
    y = round(wide.cy_px + f_px * tangents[1] - size[1] / 2)
    x, y = min(max(0, x), wide.width - size[0]), min(max(0, y), wide.height - size[1])
    return flat[y : y + size[1], x : x + size[0]]


def _difference(left: NDArray[np.uint16], right: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return left minus right, centred on middle grey."""
    signed = (left.astype(np.int32) - right.astype(np.int32)) // 2 + 32768
    return np.clip(signed, 0, 65535).astype(np.uint16)


def _as_16_bits(frame: Frame) -> NDArray[np.uint16]:
    return np.asarray(frame.image.astype(np.uint16) << (16 - frame.bits), dtype=np.uint16)


def _has_wide(point: DatasetPoint) -> bool:
    return any(frame.role is Role.WIDE for frame in point.frames)


def _write_resource(
    folder: Path,
    name: str,
    index: str | None,
    image: NDArray[np.uint8] | NDArray[np.uint16] | None,
    facts: dict[str, object] | None,
) -> None:
    """Write a resource as NAME.png and NAME.json, or NAME/INDEX.png and NAME/INDEX.json."""
    stem = folder / name if index is None else folder / name / index
    stem.parent.mkdir(parents=True, exist_ok=True)
    if image is not None:
        write_png(stem.with_suffix(".png"), image)
    if facts is not None:
        stem.with_suffix(".json").write_text(json.dumps(facts, indent=2), encoding="utf-8")
