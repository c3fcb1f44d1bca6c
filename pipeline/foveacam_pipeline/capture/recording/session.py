"""The metadata records of a recording: time, software, rig, wide lens and calibration.

`fovea:…` records have the authors' names; `foveacam:rig` is ours, and other readers ignore it.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from foveacam_hardware.contract import DeviceInfo, FoveaError
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import calibration_document, calibration_from
from foveacam_pipeline.models.intrinsics import Intrinsics

SESSION, WIDE_CAMERA, FINALIZE, RIG = "fovea:session", "fovea:wide-camera", "fovea:finalize", "foveacam:rig"
STATISTICS = "foveacam:statistics"
APP = "foveacam-duo"
RIG_VERSION = "1"


@dataclass(frozen=True, slots=True, kw_only=True)
class RigDescription:
    """The recorded rig. `cameras`: the device behind each stream."""

    rig_id: str
    name: str
    baseline_m: float
    cameras: Mapping[str, DeviceInfo] = field(default_factory=dict)
    calibration: Calibration | None = None
    problem: str | None = None
    """Why the calibration in the file cannot be used; None when it can, or there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingSession:
    """The metadata written before the first frame. `timestamp`: ISO 8601."""

    timestamp: str
    rig: RigDescription | None = None
    app: str = APP

    def records(self) -> dict[str, dict[str, str]]:
        """Return the metadata records, by name."""
        found = {SESSION: {"timestamp": self.timestamp, "app": self.app}}
        if self.rig is not None:
            found[RIG] = _rig_record(self.rig)
            if self.rig.calibration is not None:
                found[WIDE_CAMERA] = _wide_record(self.rig.calibration)
        return found


def _rig_record(rig: RigDescription) -> dict[str, str]:
    cameras = {
        stream: {"vendor": info.vendor, "model": info.model, "serial": info.serial}
        for stream, info in rig.cameras.items()
    }
    record = {
        "version": RIG_VERSION,
        "rig_id": rig.rig_id,
        "name": rig.name,
        "baseline_m": json.dumps(rig.baseline_m),
        "cameras": json.dumps(cameras),
    }
    if rig.calibration is not None:
        record["calibration"] = json.dumps(calibration_document(rig.calibration), allow_nan=False)
    return record


def _wide_record(calibration: Calibration) -> dict[str, str]:
    """Return the wide lens under the authors' names: px, rad, mm, each value as JSON."""
    wide = calibration.wide
    ax_low, ax_high, ay_low, ay_high = wide.field_rad
    values = {
        "sensor_size": {"width": wide.width, "height": wide.height},
        "camera_matrix": wide.matrix.tolist(),
        "dist_coeffs": list(wide.distortion),
        "focal": {"x": wide.fx_px, "y": wide.fy_px},
        "center": {"x": wide.cx_px, "y": wide.cy_px},
        "fov": {"x": ax_high - ax_low, "y": ay_high - ay_low},
        "baseline_mm": 1e3 * calibration.baseline_m,
    }
    return {name: json.dumps(value) for name, value in values.items()}


def read_rig(metadata: Mapping[str, Mapping[str, str]], *, what: str) -> RigDescription | None:
    """Return the rig that a recording describes; None when it describes none or cannot be read."""
    record = metadata.get(RIG)
    if record is None:
        return None
    try:
        cameras = {
            stream: DeviceInfo(vendor=str(who["vendor"]), model=str(who["model"]), serial=str(who["serial"]))
            for stream, who in json.loads(record.get("cameras", "{}")).items()
        }
        rig_id, name, baseline_m = record["rig_id"], record["name"], float(record["baseline_m"])
    except (KeyError, ValueError, TypeError, AttributeError):
        return None
    calibration, problem = _calibration(record, what=what)
    return RigDescription(
        rig_id=rig_id,
        name=name,
        baseline_m=baseline_m,
        cameras=cameras,
        calibration=calibration,
        problem=problem,
    )


def _calibration(record: Mapping[str, str], *, what: str) -> tuple[Calibration | None, str | None]:
    if "calibration" not in record:
        return None, None
    try:
        return calibration_from(json.loads(record["calibration"]), what=f"in {what}"), None
    except (FoveaError, ValueError) as error:
        return None, str(error)


def read_wide_lens(metadata: Mapping[str, Mapping[str, str]]) -> tuple[Intrinsics, float | None] | None:
    """Return the wide lens and the baseline, m, of `fovea:wide-camera`; None where they cannot be read."""
    record = metadata.get(WIDE_CAMERA)
    if record is None:
        return None
    try:
        values: dict[str, Any] = {  # Any: JSON of another program
            name: json.loads(record[name]) for name in ("sensor_size", "camera_matrix", "dist_coeffs")
        }
        size, matrix = values["sensor_size"], values["camera_matrix"]
        width, height = (size["width"], size["height"]) if isinstance(size, dict) else size
        lens = Intrinsics(
            width=int(width),
            height=int(height),
            fx_px=float(matrix[0][0]),
            fy_px=float(matrix[1][1]),
            cx_px=float(matrix[0][2]),
            cy_px=float(matrix[1][2]),
            distortion=tuple(float(value) for value in _flat(values["dist_coeffs"])),
        )
        baseline_mm = json.loads(record["baseline_mm"]) if "baseline_mm" in record else None
        return lens, None if baseline_mm is None else float(baseline_mm) / 1e3
    except (KeyError, ValueError, TypeError, IndexError):
        return None


def _flat(found: object) -> list[Any]:  # Any: numbers, as another program wrote them
    if isinstance(found, list):
        return [entry for part in found for entry in _flat(part)]
    return [found]
