"""Presets: the settings of all cameras, saved under a name and applied later."""

from foveacam_hardware.contract import AutoMode, FoveaError, NotConnected, PixelFormat, Role, ValueRange
from foveacam_server.foundation.named_documents import NamedDocument, NamedDocuments
from foveacam_server.foundation.names import utc_now
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.resources.devices.cameras.changes import CameraChange
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.status import CameraStatus

CHANGED_S = 30.0
"""Timeout of a change, in which each camera is stopped, set and started again."""


class PresetCamera(ResponseModel):
    """The settings of one camera."""

    role: Role
    exposure_ms: float
    exposure_auto: AutoMode
    gain_db: float
    black_level: float
    frame_rate_hz: float
    frame_rate_auto: bool
    pixel_format: PixelFormat


class CameraPreset(NamedDocument):
    """The settings of all cameras under a name."""

    saved_utc: str
    cameras: list[PresetCamera]


class CameraPresets:
    """Saves and applies presets; callable from any thread except the hardware thread."""

    def __init__(self, presets: NamedDocuments[CameraPreset], cameras: CameraSettingsService) -> None:
        self.presets = presets
        self._cameras = cameras

    def save(self, name: str, hardware: HardwareThread) -> CameraPreset:
        """Save the cameras' present settings; raise `NotConnected` without a camera."""
        present = [camera for camera in hardware.status.cameras if camera.connected]
        if not present and not hardware.status.opened:
            raise refusals.not_open(hardware.status)
        if not present:
            raise NotConnected("no camera is connected whose settings could be saved; connect one")
        preset = CameraPreset(name=name, saved_utc=utc_now(), cameras=[_saved(one) for one in present])
        self.presets.put(preset)
        return preset

    def apply(self, name: str, hardware: HardwareThread) -> CameraPreset:
        """Apply a preset to all its connected cameras or to none; raise as a change of settings does."""
        preset = self.presets.get(name)
        present = {camera.role: camera for camera in hardware.status.cameras if camera.connected}
        done: list[CameraStatus] = []
        try:
            for wanted in preset.cameras:
                if (camera := present.get(wanted.role)) is not None:
                    self._change(hardware, camera, wanted)
                    done.append(camera)
        except FoveaError:
            for camera in done:
                self._change(hardware, camera, _saved(camera))
            raise
        return preset

    def _change(self, hardware: HardwareThread, camera: CameraStatus, wanted: PresetCamera) -> None:
        change = _change_to(wanted, camera)
        if change.changes:
            changed = self._cameras.change(hardware, (wanted.role,), change)
            answer_of(changed, asked=f"the settings of camera {wanted.role}", within_s=CHANGED_S)


def _saved(camera: CameraStatus) -> PresetCamera:
    settings = camera.settings
    return PresetCamera(
        role=camera.role,
        exposure_ms=settings.exposure_ns / 1e6,
        exposure_auto=settings.exposure_auto,
        gain_db=settings.gain_db,
        black_level=settings.black_level,
        frame_rate_hz=settings.frame_rate_hz,
        frame_rate_auto=settings.frame_rate_auto,
        pixel_format=settings.pixel_format,
    )


def _change_to(wanted: PresetCamera, camera: CameraStatus) -> CameraChange:
    """Return the change that gives a camera these settings, without those that it does not support."""
    ranges = camera.ranges
    by_itself = wanted.exposure_auto is not AutoMode.OFF
    return CameraChange(
        exposure_ns=None if by_itself else round(wanted.exposure_ms * 1e6),
        exposure_auto=wanted.exposure_auto if wanted.exposure_auto in ranges.exposure_autos else None,
        gain_db=wanted.gain_db if _settable(ranges.gain_db) else None,
        black_level=wanted.black_level if _settable(ranges.black_level) else None,
        frame_rate_hz=(
            wanted.frame_rate_hz if _settable(ranges.frame_rate_hz) and not wanted.frame_rate_auto else None
        ),
        frame_rate_auto=wanted.frame_rate_auto if ranges.frame_rate_auto else None,
        pixel_format=wanted.pixel_format if wanted.pixel_format in ranges.pixel_formats else None,
    )


def _settable(span: ValueRange) -> bool:
    return span.low < span.high
