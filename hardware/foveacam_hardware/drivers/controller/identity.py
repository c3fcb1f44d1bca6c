"""Identifies what answers on the controller's port: a supported controller, or why it is not one."""

from dataclasses import dataclass

from foveacam_hardware.contract import DeviceFault, DeviceInfo, FoveaError, NotConnected, Timeout
from foveacam_hardware.drivers.controller.requests import ControllerRequests
from foveacam_hardware.drivers.controller.session import ControllerSession
from foveacam_hardware.wire.controller import USB_PRODUCT_ID, USB_VENDOR_ID, BadPacket

FIRST_KNOWN_MAJOR, LAST_KNOWN_MAJOR = 1, 2
FIRST_WITH_CLOCK = (1, 1, 0)
FIRST_WITH_FRAMES = (2, 0, 0)
FIRST_WITH_RECOVERY = (2, 1, 0)
GUARD_SUFFIX = " +guard"
"""Suffix of the name of a firmware with watchdog and limits."""
_OTHER_DEVICES = (
    (("OK", "ERROR", "NO CARRIER", "+CME", "RING"), "a modem answers there"),
    (("Grbl",), "a Grbl board answers there, as of a pan-tilt"),
    (("login:", "Password:", "$ ", "# ", "U-Boot"), "a console answers there"),
    (("$GP", "$GN"), "a satellite receiver talks there"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedController:
    """A controller that this driver supports."""

    name: str
    version: tuple[int, int, int]

    @property
    def has_clock(self) -> bool:
        """Whether its clock can be read."""
        return self.version >= FIRST_WITH_CLOCK

    @property
    def has_frames(self) -> bool:
        """Whether it has streams and triggered exposures."""
        return self.version >= FIRST_WITH_FRAMES

    @property
    def has_recovery(self) -> bool:
        """Whether it can restart its DACs."""
        return self.version >= FIRST_WITH_RECOVERY

    @property
    def has_guard(self) -> bool:
        """Whether it has a watchdog and limits of its own."""
        return self.name.endswith(GUARD_SUFFIX)

    def info(self, *, serial: str, port: str = "") -> DeviceInfo:
        """Return the contract's value type."""
        text = ".".join(map(str, self.version))
        return DeviceInfo(vendor="FoveaCam", model=self.name, serial=serial, version=text, port=port)


UNKNOWN = IdentifiedController(name="mirror controller", version=(0, 0, 0))
"""Placeholder before any controller has answered."""


def identify_controller(requests: ControllerRequests) -> IdentifiedController:
    """Identify the controller; raise `NotConnected` or `DeviceFault` when it is not a supported one."""
    session = requests.session
    try:
        version = requests.version()
    except (Timeout, BadPacket) as failure:
        raise _unidentified(session, failure) from failure
    known = f"{FIRST_KNOWN_MAJOR}.0 to {LAST_KNOWN_MAJOR}.x"
    found = f"controller: firmware {version[0]}.{version[1]}"
    if version[0] > LAST_KNOWN_MAJOR:
        raise DeviceFault(f"{found} is newer than this driver ({known}); update the software")
    if version[0] < FIRST_KNOWN_MAJOR:
        raise DeviceFault(f"{found} is older than this driver knows ({known}); update the firmware")
    return IdentifiedController(name=requests.name(), version=version)


def _unidentified(session: ControllerSession, failure: FoveaError) -> FoveaError:
    """Return the error for a port on which no controller answers, with what is known of it."""
    port = session.identity
    wrong_port = "; correct mirrors.port in the rig file"
    if session.is_echoed:
        return NotConnected(
            f"serial port {port}: it echoes what is sent to it, as a modem or a terminal does, and no"
            f" mirror controller{wrong_port}"
        )
    if session.unrecognised:
        return NotConnected(
            f"serial port {port}: {_describe_device(session.unrecognised)}, no mirror controller{wrong_port}"
        )
    expected = (USB_VENDOR_ID, USB_PRODUCT_ID)
    if port.usb_id is not None and port.usb_id != expected:
        return NotConnected(
            f"serial port {port}: nothing answers there, and the controller's USB id is"
            f" {USB_VENDOR_ID:04x}:{USB_PRODUCT_ID:04x}{wrong_port}"
        )
    return Timeout(f"serial port {port}: {failure}")


def _describe_device(reply: bytes) -> str:
    text = reply.decode("ascii", "replace")
    for words, device in _OTHER_DEVICES:
        if any(word in text for word in words):
            return f"{device} ({_shown(reply)})"
    return f"something else answers there ({_shown(reply)})"


def _shown(reply: bytes) -> str:
    lines = reply.decode("ascii", "replace").split()
    text = " ".join(dict.fromkeys(lines))  # text repeated at each of our requests is shown once
    return repr(text) if text and text.isprintable() and "\ufffd" not in text else reply[:16].hex(" ")
