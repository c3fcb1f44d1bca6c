"""Identifies serial ports by the USB device behind them (USB id, serial number), not by their path.

Reads pyserial's list and /dev/serial/by-id. `UsbPort` finds a device again by its serial number after it was
unplugged and came back under another path.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from serial.tools import list_ports

from foveacam_hardware.contract import NotConnected

AUTO = "auto"
"""Port name that selects the only device with the right USB id."""
BY_SERIAL = "usb:"
"""Prefix of a port name that selects the device with the serial number that follows."""
BY_ID = Path("/dev/serial/by-id")
_BY_ID_SERIAL = re.compile(r"usb-.*?_?([^_]+)-if\d+.*")


@dataclass(frozen=True, slots=True, kw_only=True)
class PortIdentity:
    """A serial port and the USB device behind it, as far as the system reports it."""

    name: str
    usb_id: tuple[int, int] | None = None
    """Vendor and product id; None for a port that is not a USB device."""
    serial: str = ""
    product: str = ""

    def __str__(self) -> str:
        """Return a description for display."""
        if self.usb_id is None and not self.serial:
            return self.name
        vendor_id, product_id = self.usb_id or (0, 0)
        parts = [f"USB {vendor_id:04x}:{product_id:04x}"] if self.usb_id is not None else []
        parts += [self.product] if self.product else []
        parts += [f"serial {self.serial}"] if self.serial else []
        return f"{self.name} ({', '.join(parts)})"


PortList = Callable[[], list[PortIdentity]]


def present_ports() -> list[PortIdentity]:
    """Return the serial ports present now, sorted by name."""
    found = [
        PortIdentity(
            name=port.device,
            usb_id=None if port.vid is None or port.pid is None else (port.vid, port.pid),
            serial=port.serial_number or "",
            product=port.product or "",
        )
        for port in list_ports.comports()
    ]
    known = {port.name for port in found}
    return sorted(
        [*found, *(port for port in _linked_ports() if port.name not in known)], key=lambda port: port.name
    )


def serial_of_link(link: str) -> str:
    """Return the serial number in the name of a link below /dev/serial/by-id; "" when there is none."""
    named = _BY_ID_SERIAL.fullmatch(link)
    return "" if named is None else named[1]


def identify(port: str, *, ports: PortList = present_ports) -> PortIdentity:
    """Return the identity of the port at a path, which may be a symbolic link."""
    device = str(Path(port).resolve())
    return next((found for found in ports() if found.name == device), PortIdentity(name=port))


class UsbPort:
    """A port as named in a rig file (`auto`, `usb:SERIAL` or a path), resolved again at each opening.

    Once a device with a serial number was opened, only that device is accepted, under whatever path.
    """

    def __init__(self, named: str, *, usb_id: tuple[int, int], ports: PortList = present_ports) -> None:
        self.named = named
        self._usb_id = usb_id
        self._ports = ports
        self._serial = named.removeprefix(BY_SERIAL) if named.startswith(BY_SERIAL) else ""

    def path(self) -> str:
        """Return the device's current path; raise `NotConnected` when it is not present."""
        by_path = not (self.named == AUTO or self.named.startswith(BY_SERIAL))
        if by_path and (not self._serial or self._is_same_device(self.named)):
            return self.named
        if self._serial:
            return self._by_serial()
        return self._only_one()

    def opened(self, identity: PortIdentity) -> None:
        """Remember the device that was opened."""
        self._serial = identity.serial or self._serial

    def _is_same_device(self, port: str) -> bool:
        if not Path(port).exists():
            return False
        return identify(port, ports=self._ports).serial in ("", self._serial)

    def _by_serial(self) -> str:
        present = self._ports()
        for port in present:
            if port.serial == self._serial:
                return port.name
        raise NotConnected(
            f"serial port {self.named}: no USB device with the serial number {self._serial} is plugged in"
            f" ({_listed(present)}); plug in the controller and switch it on, or correct the port"
        )

    def _only_one(self) -> str:
        present = self._ports()
        fitting = [port for port in present if port.usb_id == self._usb_id]
        vendor_id, product_id = self._usb_id
        if not fitting:
            raise NotConnected(
                f"serial port {self.named}: no device with the controller's USB id"
                f" {vendor_id:04x}:{product_id:04x} is plugged in ({_listed(present)}); plug in the"
                " controller and switch it on, or name its port"
            )
        if len(fitting) > 1:
            first = next((port.serial for port in fitting if port.serial), "SERIAL")
            raise NotConnected(
                f"serial port {self.named}: {len(fitting)} devices have the controller's USB id"
                f" ({_listed(fitting)}); name the one that is meant, as in port ="
                f' "{BY_SERIAL}{first}"'
            )
        return fitting[0].name


def _linked_ports() -> list[PortIdentity]:
    """Return the ports by udev's links, for systems whose device tree is not readable (containers)."""
    if not BY_ID.is_dir():
        return []
    return [
        PortIdentity(name=str(link.resolve()), serial=serial, product=link.name)
        for link in sorted(BY_ID.iterdir())
        if (serial := serial_of_link(link.name))
    ]


def _listed(ports: Sequence[PortIdentity]) -> str:
    return "ports present: " + (", ".join(map(str, ports)) or "none")
