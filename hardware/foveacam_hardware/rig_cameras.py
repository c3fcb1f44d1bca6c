"""Builds the cameras of a rig file, and lists the searches for connected cameras by driver kind.

Besides `rig`, the only module that names concrete camera drivers. Connecting is left to the cameras.
"""

from collections.abc import Callable
from typing import TypeAlias

from foveacam_hardware.camera_config import (
    AbsentCameraConfig,
    AravisCameraConfig,
    CameraConfig,
    OpenCvCameraConfig,
    PresentCameraConfig,
    PylonCameraConfig,
)
from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    CameraSettings,
    Clock,
    DeviceInfo,
    PixelFormat,
    Role,
    TriggerSource,
)
from foveacam_hardware.drivers.cameras.absent import AbsentCamera
from foveacam_hardware.drivers.cameras.aravis import library as aravis_library
from foveacam_hardware.drivers.cameras.aravis.device import AravisDevice
from foveacam_hardware.drivers.cameras.aravis.settings import AravisOptions
from foveacam_hardware.drivers.cameras.device import CameraDevice, FoundCamera
from foveacam_hardware.drivers.cameras.held_device import CameraPlan
from foveacam_hardware.drivers.cameras.opencv import video_devices
from foveacam_hardware.drivers.cameras.opencv.device import OpenCvDevice, OpenCvOptions
from foveacam_hardware.drivers.cameras.opencv.source import SourceKind, kind_of, shown
from foveacam_hardware.drivers.cameras.pylon import library as pylon_library
from foveacam_hardware.drivers.cameras.pylon.device import PylonDevice
from foveacam_hardware.drivers.cameras.pylon.settings import PylonOptions
from foveacam_hardware.drivers.cameras.supervised import SupervisedCamera

NS_PER_MS = 1e6
NS_PER_US = 1e3
Discover: TypeAlias = Callable[[], list[FoundCamera]]
"""Returns the cameras that a library sees, without opening any; raises `NotConnected` without the library."""


def camera_searches() -> dict[str, Discover]:
    """Return each driver's camera search by the kind that rig files use; none has run yet."""
    return {
        "aravis": aravis_library.find_cameras,
        "pylon": pylon_library.find_cameras,
        "opencv": video_devices.find_cameras,
    }


def build_camera(role: Role, given: CameraConfig, *, clock: Clock) -> Camera:
    """Return the camera of a role, not connected; an `AbsentCamera` where the file names none."""
    if isinstance(given, AbsentCameraConfig):
        return AbsentCamera(
            role,
            reason="the rig file names none",
            remedy='give it a kind there, such as "aravis", and start the server again',
        )
    return _supervised(role, given, lambda: build_device(given, clock=clock), clock=clock)


def build_device(given: PresentCameraConfig, *, clock: Clock) -> CameraDevice:
    """Return the driver's device of a camera, not opened."""
    match given:
        case AravisCameraConfig():
            return _aravis(given, clock)
        case PylonCameraConfig():
            return _pylon(given, clock)
        case OpenCvCameraConfig():
            return _opencv(given, clock)


def plan_of(role: Role, given: PresentCameraConfig) -> CameraPlan:
    """Return the settings, readout time and buffer count that a camera is opened with."""
    return CameraPlan(
        settings=first_settings(role, given),
        readout_ns=round(given.readout_us * NS_PER_US),
        frames=given.buffers,
    )


def first_settings(role: Role, given: PresentCameraConfig) -> CameraSettings:
    """Return a camera's initial settings; foveae wait for the mirrors' pulse by default."""
    if isinstance(given, OpenCvCameraConfig):
        return _opencv_settings(given)
    trigger = given.trigger or ("none" if role is Role.WIDE else "hardware")
    return CameraSettings(
        exposure_ns=round(given.exposure_ms * NS_PER_MS),
        exposure_auto=AutoMode(given.exposure_auto),
        gain_db=given.gain_db,
        frame_rate_hz=given.frame_rate_hz,
        frame_rate_auto=given.frame_rate_auto,
        pixel_format=PixelFormat(given.pixel_format),
        triggered=trigger != "none",
        trigger_source=TriggerSource.SOFTWARE if trigger == "software" else TriggerSource.HARDWARE,
        black_level=given.black_level,
    )


def _opencv_settings(given: OpenCvCameraConfig) -> CameraSettings:
    """Return the file's settings; 0 or automatic for what it leaves to the source."""
    given_keys = given.model_fields_set
    own_rate = given.frame_rate_auto if "frame_rate_auto" in given_keys else "frame_rate_hz" not in given_keys
    camera_exposes = given.exposure_ms is None and kind_of(given.source) is SourceKind.DEVICE
    default_auto = AutoMode.CONTINUOUS if camera_exposes else AutoMode.OFF
    return CameraSettings(
        exposure_ns=round((given.exposure_ms or 0.0) * NS_PER_MS),
        exposure_auto=AutoMode(given.exposure_auto or default_auto),
        gain_db=given.gain_db or 0.0,
        frame_rate_hz=0.0 if own_rate else given.frame_rate_hz,
        frame_rate_auto=own_rate,
        pixel_format=PixelFormat(given.pixel_format),
        triggered=given.trigger == "software",
        trigger_source=TriggerSource.SOFTWARE,
    )


def _supervised(
    role: Role,
    given: PresentCameraConfig,
    open_device: Callable[[], CameraDevice],
    *,
    clock: Clock,
) -> Camera:
    name = shown(given.source) if isinstance(given, OpenCvCameraConfig) else given.serial
    return SupervisedCamera(
        role,
        open_device,
        clock=clock,
        plan=plan_of(role, given),
        expected=DeviceInfo(vendor="", model=given.kind, serial=name),
    )


def _aravis(given: AravisCameraConfig, clock: Clock) -> CameraDevice:
    options = AravisOptions(
        trigger_line=given.trigger_line,
        falling_edge=given.trigger_edge == "falling",
        strobe_line=given.strobe_line,
        width_px=given.width_px,
        height_px=given.height_px,
        offset_x_px=given.offset_x_px,
        offset_y_px=given.offset_y_px,
        packet_size_bytes=given.packet_size_bytes,
        packet_delay_ns=given.packet_delay_ns,
        interface=given.interface,
    )
    return AravisDevice(given.serial, clock=clock, options=options)


def _pylon(given: PylonCameraConfig, clock: Clock) -> CameraDevice:
    options = PylonOptions(
        trigger_line=given.trigger_line,
        trigger_edge=given.trigger_edge,
        strobe_line=given.strobe_line,
        width=given.width_px,
        height=given.height_px,
        offset_x=given.offset_x_px,
        offset_y=given.offset_y_px,
    )
    return PylonDevice(given.serial, clock=clock, options=options)


def _opencv(given: OpenCvCameraConfig, clock: Clock) -> CameraDevice:
    options = OpenCvOptions(width=given.width_px, height=given.height_px, loop=given.loop)
    return OpenCvDevice(given.source, clock=clock, options=options)
