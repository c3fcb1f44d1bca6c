"""Describes the rig and the conditions of a capture; runs on the thread that owns the devices."""

from pydantic import JsonValue

from foveacam_hardware.contract import Camera, DeviceInfo, PanTiltPose
from foveacam_pipeline.capture.run.access import CaptureRig, trigger_head


def rig_document(rig: CaptureRig) -> dict[str, JsonValue]:
    """Return the identity of the rig and of its devices."""
    cameras: dict[str, JsonValue] = {
        camera.role.value: _device(camera.info) for camera in (rig.wide, rig.left, rig.right)
    }
    return {
        "rig_id": rig.rig_id,
        "name": rig.name,
        "simulated": rig.simulated,
        "baseline_m": rig.baseline_m,
        "cameras": cameras,
        "mirrors": _device(rig.mirrors.info),
    }


def conditions_document(
    rig: CaptureRig, *, measured_m: tuple[float | None, ...] = ()
) -> dict[str, JsonValue]:
    """Return the settings of the rig; `measured_m`: distances found by the fixations before the capture."""
    pose = pan_tilt_pose(rig)
    return {
        "scene": rig.scene,
        "settle_us": trigger_head(rig).settle_us,
        "low_pass_hz": rig.mirrors.low_pass_hz,
        "cameras": {camera.role.value: _settings(camera) for camera in (rig.wide, rig.left, rig.right)},
        "rail_m": rail_position_m(rig),
        "pan_rad": None if pose is None else pose.pan_rad,
        "tilt_rad": None if pose is None else pose.tilt_rad,
        "survey_distances_m": list(measured_m),
    }


def pan_tilt_pose(rig: CaptureRig) -> PanTiltPose | None:
    """Return the pose of the pan-tilt; None where it is unknown."""
    return None if rig.pan_tilt is None else rig.pan_tilt.state.pose


def rail_position_m(rig: CaptureRig) -> float | None:
    """Return the position of the rig on its rail, m; None where it is unknown."""
    return None if rig.rail is None else rig.rail.state.position_m


def _device(info: DeviceInfo) -> dict[str, JsonValue]:
    return {"vendor": info.vendor, "model": info.model, "serial": info.serial, "version": info.version}


def _settings(camera: Camera) -> dict[str, JsonValue]:
    settings = camera.settings
    return {
        "exposure_ns": settings.exposure_ns,
        "gain_db": settings.gain_db,
        "black_level": settings.black_level,
        "pixel_format": settings.pixel_format.value,
        "frame_rate_hz": settings.frame_rate_hz,
    }
