"""Loads the vendor's library for Basler cameras and lists the cameras that it sees."""

import warnings
from importlib import import_module

from foveacam_hardware.contract import DeviceInfo, NotConnected, install_command
from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_hardware.drivers.cameras.pylon.nodes import Vendor

KIND = "pylon"


def load_library() -> Vendor:
    """Import the vendor's library; raise `NotConnected` with the install command when it is missing."""
    try:
        with warnings.catch_warnings():
            # Its C types raise a deprecation warning, which ends the process where warnings are errors
            warnings.simplefilter("ignore", DeprecationWarning)
            return import_module("pypylon.pylon")
    except ImportError as error:
        raise NotConnected(
            f"Basler cameras need the vendor's library, which cannot be loaded ({error});"
            f" {install_command('pylon')}"
        ) from error


def find_serial(pylon: Vendor, serial: str) -> Vendor:
    """Return the library's entry of a camera; raise `NotConnected` that lists the cameras present."""
    entries = pylon.TlFactory.GetInstance().EnumerateDevices()
    for entry in entries:
        if entry.GetSerialNumber() == serial:
            return entry
    seen = ", ".join(sorted(entry.GetSerialNumber() for entry in entries)) or "none"
    raise NotConnected(
        f"pylon camera {serial}: it is not on the bus (found: {seen}); plug it in, or correct its serial"
        " number"
    )


def find_cameras() -> list[FoundCamera]:
    """Return the cameras that the library sees; raise `NotConnected` when it is not installed."""
    entries = load_library().TlFactory.GetInstance().EnumerateDevices()
    return [_found(entry) for entry in entries]


def _found(entry: Vendor) -> FoundCamera:
    address = entry.GetIpAddress() if entry.IsIpAddressAvailable() else entry.GetFullName()
    info = DeviceInfo(
        vendor="Basler", model=str(entry.GetModelName()), serial=str(entry.GetSerialNumber()), version=""
    )
    return FoundCamera(kind=KIND, info=info, address=str(address))
