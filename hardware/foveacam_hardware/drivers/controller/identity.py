"""Who answers on the controller's port: the controller and its firmware, or somebody else, in a sentence."""

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
"""Ends the name of a firmware that watches over its host."""
_VOICES = (
    (("OK", "ERROR", "NO CARRIER", "+CME", "RING"), "a modem answers there"),
    (("Grbl",), "a Grbl board answers there, as of a pan-tilt"),
    (("login:", "Password:", "$ ", "# ", "U-Boot"), "a console answers there"),
    (("$GP", "$GN"), "a satellite receiver talks there"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedController:
    """A controller that this driver can use."""

    name: str
    version: tuple[int, int, int]

    @property
    def has_clock(self) -> bool:
        """Whether it tells its time."""
        return self.version >= FIRST_WITH_CLOCK

    @property
    def has_frames(self) -> bool:
        """Whether it has streams and triggered exposures."""
        return self.version >= FIRST_WITH_FRAMES

    @property
    def has_recovery(self) -> bool:
        """Whether it can start its DACs anew."""
        return self.version >= FIRST_WITH_RECOVERY

    @property
    def has_guard(self) -> bool:
        """Whether it has a watchdog and limits of its own."""
        return self.name.endswith(GUARD_SUFFIX)

    def info(self, *, serial: str, port: str = "") -> DeviceInfo:
        """Return it as the contract's."""
        text = ".".join(map(str, self.version))
        return DeviceInfo(vendor="FoveaCam", model=self.name, serial=serial, version=text, port=port)


UNKNOWN = IdentifiedController(name="mirror controller", version=(0, 0, 0))
"""Before any has answered."""


def identify_controller(dialogue: ControllerRequests) -> IdentifiedController:
    """Ask who answers; raise `NotConnected` or `DeviceFault` when it is nobody that this driver can use."""
    session = dialogue.session
    try:
        version = dialogue.version()
    except (Timeout, BadPacket) as failure:
        raise _nobody(session, failure) from failure
    known = f"{FIRST_KNOWN_MAJOR}.0 to {LAST_KNOWN_MAJOR}.x"
    found = f"controller: firmware {version[0]}.{version[1]}"
    if version[0] > LAST_KNOWN_MAJOR:
        raise DeviceFault(f"{found} is newer than this driver ({known}); update the software")
    if version[0] < FIRST_KNOWN_MAJOR:
        raise DeviceFault(f"{found} is older than this driver knows ({known}); update the firmware")
    return IdentifiedController(name=dialogue.name(), version=version)


def _nobody(session: ControllerSession, failure: FoveaError) -> FoveaError:
    """Return what is known of an answer that was none of the controller's."""
    port = session.identity
    wrong_port = "; correct mirrors.port in the rig file"
    if session.echoes:
        return NotConnected(
            f"serial port {port}: it sends back what it is told, as a modem or a terminal does, and no"
            f" mirror controller{wrong_port}"
        )
    if session.strange:
        return NotConnected(
            f"serial port {port}: {_voice(session.strange)}, no mirror controller{wrong_port}"
        )
    expected = (USB_VENDOR_ID, USB_PRODUCT_ID)
    if port.usb_id is not None and port.usb_id != expected:
        return NotConnected(
            f"serial port {port}: nothing answers there, and the controller's USB id is"
            f" {USB_VENDOR_ID:04x}:{USB_PRODUCT_ID:04x}{wrong_port}"
        )
    return Timeout(f"serial port {port}: {failure}")


def _voice(said: bytes) -> str:
    text = said.decode("ascii", "replace")
    for words, who in _VOICES:
        if any(word in text for word in words):
            return f"{who} ({_shown(said)})"
    return f"something else answers there ({_shown(said)})"


def _shown(said: bytes) -> str:
    lines = said.decode("ascii", "replace").split()
    text = " ".join(dict.fromkeys(lines))  # what it repeats at each of our requests, once
    return repr(text) if text and text.isprintable() and "\ufffd" not in text else said[:16].hex(" ")
