"""Trial of one device that no rig has open: an image of a camera, or the identity of what answers on a port.

It shows a person which camera it is, or whether a mirror controller or pan-tilt is there; nothing moves or is
switched on.
"""

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
    DeviceInfo,
    FoveaError,
    Image,
    InvalidInput,
    Role,
    Timeout,
)
from foveacam_hardware.drivers.cameras.device import CameraDevice, GrabStatus
from foveacam_hardware.drivers.controller.identity import identify_controller
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.rig_base import build_base
from foveacam_hardware.rig_cameras import build_device, first_settings
from foveacam_hardware.rig_config import SerialRigConfig
from foveacam_hardware.wire.controller import USB_PRODUCT_ID, USB_VENDOR_ID
from foveacam_hardware.wire.link import usb_link

FRAMES = 8
"""Frames in which the automatic exposure settles; the last one is returned."""
TIMEOUT_MS = 2000.0
_ANY_CAMERA: TypeAdapter[PresentCameraConfig] = TypeAdapter(
    Annotated[PresentCameraConfig, Field(discriminator="kind")]
)
ANSWER_S = 1.0


def named_camera(kind: str, name: str) -> PresentCameraConfig:
    """Return the configuration of a camera by its driver's kind and its serial number or source.

    Raise `InvalidInput` for a serial number that a rig file would not accept.
    """
    content = {"kind": kind, "source" if kind == "opencv" else "serial": name}
    try:
        return _ANY_CAMERA.validate_python(content)
    except ValidationError as error:
        raise InvalidInput(f"{kind} camera {name}: {explain_file(error, content)}") from error


def take_picture(given: PresentCameraConfig, *, clock: Clock) -> tuple[Image, int]:
    """Open a camera, take one picture with automatic exposure, and close it; return the picture and its bits.

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
        with suppress(FoveaError):  # without automatic exposure a picture serves as well
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
            f"camera {name}: it opens but sends no picture; check its cable, its power and its trigger"
        )
    return found


def _name(given: PresentCameraConfig) -> str:
    return str(given.source) if given.kind == "opencv" else given.serial


def ask_controller(port: str, *, clock: Clock) -> DeviceInfo:
    """Return the identity of the mirror controller on a port; raise a `FoveaError` where none answers."""
    link = usb_link(port, usb_id=(USB_VENDOR_ID, USB_PRODUCT_ID))()
    session = ControllerSession(link, clock)
    with closing(session):
        controller = identify_controller(ControllerRequests(session, deadline_s=ANSWER_S))
        attached = session.identity
        return controller.info(serial=attached.serial or port, port=attached.name)


def ask_pan_tilt(config: SerialRigConfig, *, clock: Clock) -> DeviceInfo:
    """Connect the pan-tilt of a rig file and close it again; return its identity."""
    pan_tilt = build_base(config, clock).pan_tilt
    if pan_tilt is None:
        raise ValueError("the rig has no pan-tilt")
    with closing(pan_tilt):
        pan_tilt.connect()
        return pan_tilt.info
