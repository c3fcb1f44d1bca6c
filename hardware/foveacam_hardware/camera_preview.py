"""Takes one picture with a camera that no rig has open, so that a person sees which camera it is."""

from contextlib import closing, suppress
from dataclasses import replace
from typing import Annotated

from pydantic import Field, TypeAdapter, ValidationError

from foveacam_hardware.camera_config import PresentCameraConfig
from foveacam_hardware.config_errors import explain_file
from foveacam_hardware.contract import (
    AutoMode,
    CameraSettings,
    Clock,
    FoveaError,
    Image,
    InvalidInput,
    Role,
    Timeout,
)
from foveacam_hardware.drivers.cameras.device import CameraDevice, GrabStatus
from foveacam_hardware.rig_cameras import build_device, first_settings

FRAMES = 8
"""Frames that automatic exposure gets; the last is the picture."""
TIMEOUT_MS = 2000.0
_ANY_CAMERA: TypeAdapter[PresentCameraConfig] = TypeAdapter(
    Annotated[PresentCameraConfig, Field(discriminator="kind")]
)


def named_camera(kind: str, name: str) -> PresentCameraConfig:
    """Return the configuration of a camera by its driver's kind and its serial number or source.

    Raise `InvalidInput` for a serial number that no rig file may have.
    """
    content = {"kind": kind, "source" if kind == "opencv" else "serial": name}
    try:
        return _ANY_CAMERA.validate_python(content)
    except ValidationError as error:
        raise InvalidInput(f"{kind} camera {name}: {explain_file(error, content)}") from error


def take_picture(given: PresentCameraConfig, *, clock: Clock) -> tuple[Image, int]:
    """Open a camera, take one picture as bright as it can be, and close it; return it and its bits.

    Raise `NotConnected` for a camera that is absent or held by another program, `Timeout` without a frame.
    """
    device = build_device(given, clock=clock)
    with closing(device):
        device.open()
        _configure(device, first_settings(Role.WIDE, given))
        device.start()
        return _last_picture(device, name=_name(given))


def _configure(device: CameraDevice, settings: CameraSettings) -> None:
    """Let the camera run freely, with automatic exposure where it has one."""
    if AutoMode.CONTINUOUS in device.ranges().exposure_autos:
        with suppress(FoveaError):  # a picture with the plain settings does as well
            device.configure(replace(settings, exposure_auto=AutoMode.CONTINUOUS))
            return
    device.configure(settings)


def _last_picture(device: CameraDevice, *, name: str) -> tuple[Image, int]:
    found = None
    for _ in range(FRAMES):
        grab = device.grab(timeout_ms=TIMEOUT_MS)
        if grab is not None and grab.status is GrabStatus.OK and grab.image is not None:
            found = grab.image, grab.bits
    if found is None:
        raise Timeout(
            f"camera {name}: it opens and sends no picture; check its cable, its power and its trigger"
        )
    return found


def _name(given: PresentCameraConfig) -> str:
    return str(given.source) if given.kind == "opencv" else given.serial
