"""Asks what answers on a serial port: a mirror controller or a pan-tilt; nothing moves or is switched on."""

from contextlib import closing

from foveacam_hardware.contract import Clock, DeviceInfo
from foveacam_hardware.drivers.controller.identity import identify_controller
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.rig_base import build_base
from foveacam_hardware.rig_config import SerialRigConfig
from foveacam_hardware.wire.controller import USB_PRODUCT_ID, USB_VENDOR_ID
from foveacam_hardware.wire.link import usb_link

ANSWER_S = 1.0


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
